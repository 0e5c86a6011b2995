import js from "@eslint/js";

// What browsers have and the page uses; any other name is one that was not imported.
const BROWSER = [
  "Blob", "DecompressionStream", "Element", "HTMLInputElement", "IntersectionObserver", "ResizeObserver", "Response", "TextDecoder", "TextEncoder",
  "URL", "VideoEncoder", "VideoFrame", "WebSocket", "addEventListener", "atob", "clearTimeout", "devicePixelRatio", "document",
  "fetch", "getComputedStyle", "innerHeight", "innerWidth", "localStorage", "location",
  "matchMedia", "navigator", "performance", "requestAnimationFrame", "setTimeout", "window",
];

export default [
  js.configs.recommended,
  {
    files: ["src/**/*.js"],
    languageOptions: {
      globals: Object.fromEntries(BROWSER.map((name) => [name, "readonly"])),
    },
    linterOptions: { reportUnusedDisableDirectives: "error" },
    rules: {
      complexity: ["error", 12],
      eqeqeq: "error",
      "max-lines": ["error", 320],
      "max-lines-per-function": ["error", 60],
      "no-shadow": "error",
      "no-unused-vars": ["error", { argsIgnorePattern: "^_" }],
      "no-use-before-define": ["error", { functions: false, classes: true, variables: false }],
      "no-var": "error",
      "prefer-const": "error",
    },
  },
  {
    files: ["src/meshcat.js"],
    languageOptions: { globals: { MeshCat: "readonly" } },
  },
];
