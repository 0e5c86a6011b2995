// What Python sends (gne_mj/viewer: scene.py, shown_system.py, replay.py, session.py, controls.py), and what
// modules of the page expect of each other.

/** An object of three.js, which comes inside meshcat's bundle and has no types. */
export type Three = any;

export type Numbers = Float64Array | Float32Array | Int32Array | Uint8Array;

export interface Pack {
  meta: any; // by its kind: Scene, Frame, ...
  arrays: Record<string, { data: Numbers; shape: number[] }>;
}

export interface Quantity {
  name: string;
  long_name: string;
  symbol: string; // TeX
  unit: string;
  labels: string[];
  bound: (number | null)[] | null;
  lower_bound: (number | null)[] | null;
  moving_bounds: { bound?: string; lower_bound?: string }; // arrays of those that change in time
  between: ([number, number] | null)[]; // agents, from 1, of each entry that is a distance
}

/** Colours of lines on each theme's ground. */
export type Palette = Record<"dark" | "light", string[]>;

/** What lies on the ground under robots whose positions are decided. */
export interface Plan {
  velocity: number[]; // m/s, of what positions are relative to
  region: [number, number][]; // corners, m
  radius: (number | null)[]; // m, of each agent's disc
}

export interface System {
  name: string;
  game: string;
  agent_name: string;
  agents: number;
  information: string;
  mode: string;
  engine: string;
  drawn_as: "bars" | "fleet";
  action: { name: string; unit: string; owner: number[]; axis: string[] }; // owners from 1
  quantities: Quantity[];
  edges: [number, number][]; // agents from 1
  edges_are: "measurements" | "messages";
  links: [number, number][]; // [hearer, sender], from 1
  message_period: number | null; // s; null if messages flow all the time, or are sent by triggers
  triggered: boolean;
  estimates: boolean;
  kept: { by: number[]; action: number[] } | null; // whose estimates, from 1; null: all are kept
  anchors: number[]; // the item at which each robot is
  rooms: [number, number, number][]; // cylinders around anchors: radius, lower, upper end, m
  floor: number | null; // m, the height of its model's, if that has one
  sky?: number[][] | null; // colours, 0 to 1, at its zenith, at its horizon and below
  light?: Light | null;
  plan: Plan | null;
  joints: JointRow[][]; // of each robot
  tints: string[][]; // paths of what has each agent's colour
  items: [number, number]; // the first of its items, and how many they are
  world?: string; // the path of what never moves of a fleet
  run: number; // from 0, where several are compared
  shift: [number, number]; // m along x and y, by which it is drawn beside others of its run
  beside: [number, number]; // m more, where runs are drawn beside each other
  shown: Shown; // the page's own
}

/** Where a model's light comes from, in parts of all of it. */
export interface Light {
  from: number[][]; // toward each light, and its part
  head: number; // the part at the camera
}

/** How the page draws a system. */
export interface Shown {
  offset: [number, number]; // m along x and y, from where it was simulated
  faint: boolean; // translucent, over another run's
  off: boolean; // not at all
  over: System | null; // the system of the other run
  alike: string[]; // systems whose bars have one scale
}

/** One of several runs that are compared. */
export interface Run {
  name: string;
  heading: string; // what is different of it, or its name
  about: string; // all that is different
  end: number; // s
  systems: Record<string, string>; // what each of its systems is compared by
}

export interface Control {
  key: string;
  label: string;
  system: string;
  unit: string;
  value: number;
  min: number;
  max: number;
  scale: "linear" | "log";
}

/** How an agent is pushed along one of its axes. */
export interface Way {
  unit: string; // N, or N m
  along: number[] | null; // the force's direction; null where it has none, as where it turns
  item: number | null; // in whose frame that is, which may turn; null: the world's
}

export interface Push {
  system: string;
  axes: string[];
  force: number; // in the way's unit
  duration: number; // s
  ways: (Way | null)[][]; // of each agent and axis; null where nothing can be pushed
}

/** A joint or an actuator of a robot: where its numbers are among all joints', and their units. */
export interface JointRow {
  name: string;
  position?: [number, string];
  velocity?: [number, string];
  control?: [number, string];
}

/** How a system's run stands, or how it ended. */
export interface State {
  status: string;
  message?: string;
  margin?: number | null;
  margin_name?: string | null;
  margin_time?: number | null; // s
  exit_time?: number | null; // s
}

export interface Intervention {
  time: number; // s
  what: string;
  system?: string;
  link?: [number, number]; // agents from 1
  lost?: boolean;
}

export interface Scene {
  title: string;
  palette: Palette;
  duration: number; // s
  items: string[]; // paths of what has a pose, in the order of poses
  systems: System[];
  controls?: Control[]; // of a live page
  pushes?: Push[];
  outcome?: Record<string, State>; // of a replay
  interventions?: Intervention[];
  scenario?: string | null; // a file's text, with what was done
  command_lengths?: number[];
  runs?: Run[]; // if there are several
}

export interface Frame {
  time: number; // s
  playing: boolean;
  speed: number | null; // null: as fast as possible
  pace: number | null;
  ended: boolean;
  state: Record<string, State>;
}

/** Everything at one time: of each system its arrays by their short names. */
export interface Instant {
  time: number; // s
  poses: Numbers | undefined; // of 8 numbers an item: position, quaternion, length (0: hidden)
  systems: Record<string, Record<string, Numbers | undefined>>;
}

/** What was simulated, for plots. */
export interface Store {
  time: number[];
  column(array: string, k: number): (number | null)[];
  greatest(array: string): number;
}

/** Where instants come from: a simulation that runs, or a replay, whose time is the page's own. */
export interface Source {
  store: Store;
  seekable: boolean;
  time: number; // s
  end: number; // s, where the slider ends
  playing: boolean;
  speed: number | null;
  pace: string; // in words
  grown: boolean; // more samples are in the store than plots know of
  exits: Record<string, number>; // when each system left the set, of those that did, s
  interventions: Intervention[];
  /** The instant to be drawn, if it is a new one. */
  take(): Instant | null;
  playPause(): void;
  step(direction: number, second: boolean): void;
  restart(): void;
  setSpeed(speed: number | null): void;
  seek(time: number): void;
  advance(seconds: number): void;
  stateOf(system: System): State;
}

/** An agent, from 0. */
export interface Agent {
  system: string;
  agent: number;
}

export interface Follow {
  kind: "fleet" | "agent" | "none";
  system?: string;
  agent?: number;
}

export type Point = number[]; // [x, y, z] in MuJoCo's coordinates, m

/** A text beside what is drawn as bars. */
export interface Text {
  point: Point;
  text: string;
  shift?: number; // px down
  align?: "center" | "left";
  bold?: boolean;
  bad?: boolean;
  limit?: boolean;
  title?: boolean;
  chosen?: boolean;
}

/** The elements of index.html that scripts look for. */
export interface Elements {
  settings: HTMLScriptElement;
  replay: HTMLScriptElement; // in a file from disk
  title: HTMLElement;
  chips: HTMLElement;
  announcement: HTMLElement;
  time: HTMLElement;
  duration: HTMLElement;
  pace: HTMLElement;
  theme: HTMLButtonElement;
  "help-open": HTMLButtonElement;
  banner: HTMLElement;
  "banner-text": HTMLElement;
  "banner-show": HTMLButtonElement;
  "banner-close": HTMLButtonElement;
  lost: HTMLElement;
  "lost-text": HTMLElement;
  "compare-label": HTMLElement;
  compare: HTMLSelectElement;
  "compare-note": HTMLElement;
  follow: HTMLSelectElement;
  "follow-label": HTMLElement;
  fit: HTMLButtonElement;
  labels: HTMLButtonElement;
  links: HTMLButtonElement;
  ghosts: HTMLButtonElement;
  "ghost-tools": HTMLElement;
  "ghost-label": HTMLElement;
  "ghost-agent": HTMLSelectElement;
  keep: HTMLDetailsElement;
  "keep-link": HTMLButtonElement;
  "keep-scenario": HTMLButtonElement;
  "keep-run": HTMLAnchorElement;
  "keep-video": HTMLButtonElement;
  recording: HTMLElement;
  "recording-text": HTMLElement;
  "recording-stop": HTMLButtonElement;
  tuning: HTMLDetailsElement;
  "tuning-body": HTMLElement;
  main: HTMLElement;
  pane: HTMLElement;
  chosen: HTMLElement;
  overlay: HTMLCanvasElement;
  waiting: HTMLElement;
  ramp: HTMLElement;
  unknown: HTMLElement;
  "link-note": HTMLElement;
  "ghost-note": HTMLElement;
  divider: HTMLElement;
  plots: HTMLElement;
  restart: HTMLButtonElement;
  back: HTMLButtonElement;
  play: HTMLButtonElement;
  step: HTMLButtonElement;
  speed: HTMLSelectElement;
  "time-track": HTMLElement;
  "time-slider": HTMLInputElement;
  "time-marks": HTMLElement;
  fold: HTMLButtonElement;
  legend: HTMLElement;
  notes: HTMLElement;
  notices: HTMLElement;
  alerts: HTMLElement;
  help: HTMLDialogElement;
}

declare global {
  /** meshcat's bundle, a script of its own. */
  const MeshCat: any;
  interface Window {
    gne: unknown;
  }
}
