"""Bad command lines, and what is done with mutated scenarios; each follows from a seed."""

import random

# What is done with a mutated file; PATH stands for it, OUT for a folder that is not there
ON_FILES = {
    "run PATH --json": 30,
    "run PATH --out OUT --json": 12,
    "run PATH": 8,
    "certify PATH --json": 8,
    "certify PATH": 4,
    "solve PATH --json": 8,
    "solve PATH --path 1:1e-6:3": 3,
    "check PATH --json": 6,
    "passivity PATH --trials 2 --json": 5,
    "map PATH --periods 0.002:0.01:2 --margins 0.1:0.5:2 --pushes 0 --runs 1 --duration 0.05": 3,
    "batch PATH --runs 2 --sweep barrier.rho=0.1,1 --out OUT": 5,
}
NUMBERS = (
    "0", "-1", "1", "1.5", "1e300", "1e999", "5e-324", "nan", "inf", "", "x", "999999999999",
    "9223372036854775808", "1" * 400, "9" * 6000, "0x10", "1_0", " 1", "\u0661", "1e-300", "-0",
    "True",
)  # fmt: skip
NAMES = (
    "velocity-sync", "osnr", "paper", "cournot", "planar-sync", "disturbed", "platoon",
    "formation", "swap", "herd", "nothing", "",
    "nothing.toml", "/dev/zero", "/", ".toml", "x" * 5000, "é\udcff.toml", "a\nb", "-", "~",
    "PATH", "folder.toml", "pipe.toml", "zero.toml", "velocity-sync.toml", "OUT",
)  # fmt: skip
SETTINGS = (
    "KEY=VALUE", "=", "=1", "barrier.rho", "barrier.rho=", "barrier.rho=NUMBER",
    "simulation.timestep=NUMBER", "simulation.duration=NUMBER", "recording.period=NUMBER",
    "simulation.control_period=NUMBER", "agents.count=NUMBER", "game.gap_bound=NUMBER",
    "simulation.seed=NUMBER", "agents.main_mass=[NUMBER, NUMBER]", "systems=1", "systems={}",
    "initial.action=NUMBER", "..=1", "barrier..rho=1", ".=1", "a.b.c.d.e.f=1", "barrier=NUMBER",
    "controller={information='partial', graph='complete'}", "controller.mode=implicit",
    "systems.robots.game.type=osnr", "simulation.tolerance=NUMBER", "initial.position=NUMBER",
    "faults=[{type='push', force=NUMBER, start=NUMBER}]", "margin={push=NUMBER, delay=NUMBER}",
    "barrier={rho=NUMBER, schedule='halving', floor=NUMBER, time_constant=NUMBER}",
    "agents={type='integrator', count=NUMBER}", "description=" + "[" * 400, "x" * 3000 + "=1",
    "description=" + "x" * 100_000, "plant.integrator=rosenbrock", "simulation.duration=1e-300",
)  # fmt: skip
RANGES = (
    "1:2:99999999999", "1:2:3", "1e300:1e-300:2", "0:1:2", "1:2", "1:2:3:4", "::", "nan:1:2",
    "1:inf:2", "1:2:-1", "1:2:0", "1:2:NUMBER", "NUMBER:NUMBER:3", "5e-324:1e308:100000",
)  # fmt: skip
PLACES = (
    "", "/", "/dev/null", "/dev/null/x", "/proc/x", ".", "..", "y" * 300, "é\udcff", "a\nb",
    "OUT", "PATH", "OUT/deep/er", "folder.toml",
)  # fmt: skip
OPTIONS = {
    "run": ("--set SETTING", "--set SETTING", "--out PLACE", "--from PLACE", "--index NUMBER",
            "--speed NUMBER", "--port NUMBER", "--json", "--nothing", "--json=NUMBER"),
    "solve": ("--path RANGE", "--rho NUMBER", "--system NAME", "--set SETTING", "--out PLACE",
              "--json"),
    "certify": ("--set SETTING", "--json", "NAME"),
    "check": ("--set SETTING", "--json", "NAME"),
    "passivity": ("--trials NUMBER", "--trials 1000000000", "--seed NUMBER", "--system NAME",
                  "--set SETTING", "--json"),
    "map": ("--periods RANGE", "--margins RANGE", "--pushes NUMBER", "--runs NUMBER",
            "--duration NUMBER", "--seed NUMBER", "--system NAME", "--set SETTING", "--out PLACE"),
    "batch": ("--sweep barrier.rho=RANGE", "--sweep SETTING", "--runs NUMBER", "--record NUMBER",
              "--seed NUMBER", "--spread NUMBER", "--chunk NUMBER", "--threads NUMBER",
              "--resume", "--system NAME", "--set SETTING", "--out PLACE", "--fail-on-exit"),
    "batch-report": ("--out PLACE", "--format NAME", "--json"),
    "plot": ("--out PLACE", "--format NAME", "--format png"),
    "view": ("--html PLACE", "--port NUMBER", "--index NUMBER"),
    "scenarios": ("NAME", "--json"),
    "paper": ("--set SETTING", "--set systems.robots.barrier.rho=NUMBER", "--json"),
    "nothing": ("--help", "--json"),
    "": ("--version", "--nothing", "NAME", "--help"),
}  # fmt: skip


def on_file(seed: int, index: int) -> list[str]:
    """What is done with one mutated file."""
    rng = random.Random(f"{seed}/{index}/command")
    return rng.choices(list(ON_FILES), list(ON_FILES.values()))[0].split()


def bad(seed: int, index: int) -> list[str]:
    """One command line."""
    rng = random.Random(f"{seed}/{index}/line")
    command = rng.choice(sorted(OPTIONS))
    words = [command] if command else []
    wanted = command not in ("scenarios", "paper", "nothing", "")
    if wanted and rng.random() < 0.95:
        usual = NAMES[:6] if command not in ("plot", "view", "batch-report") else PLACES
        words.append(rng.choice(usual if rng.random() < 0.7 else NAMES))
    for option in rng.choices(OPTIONS[command], k=rng.choice((1, 1, 2, 3))):
        words += [_filled(rng, word) for word in option.split(" ", 1)]
    if command == "batch" and "--out" not in words:
        words += ["--out", "OUT"]
    if command in ("run", "passivity") and rng.random() < 0.8:  # asked for something short
        words[2:2] = ["--set", "simulation.duration=0.2"]
    return words


def _filled(rng: random.Random, word: str) -> str:
    """A word with its placeholders replaced."""
    choices = {"SETTING": SETTINGS, "RANGE": RANGES, "NUMBER": NUMBERS}
    for name, values in choices.items():
        while name in word:
            word = word.replace(name, rng.choice(values), 1)
    whole = {"NAME": NAMES, "PLACE": PLACES}
    return rng.choice(whole[word]) if word in whole else word
