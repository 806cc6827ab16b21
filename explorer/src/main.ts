// The page: the library is unpacked and started, the state read from the address, the views put up.
import { App } from "./app.ts";
import { Core } from "./core.ts";
import { byId } from "./dom.ts";
import { measureType } from "./draw/axes.ts";
import { ChartPage } from "./pages/chart.ts";
import { DiagramPage } from "./pages/diagram.ts";
import { MotionPage } from "./pages/motion.ts";
import { Pool } from "./pool.ts";
import { SCENE } from "./scene.ts";
import { fill } from "./ui/presets.ts";
import { sharing } from "./ui/sharing.ts";
import { sidebar } from "./ui/sidebar.ts";
import { explainHeadings } from "./ui/terms.ts";
import { tour } from "./ui/tour.ts";

// Put in by the build: the worker's program. The library of each scene, deflated, is a block of data in the page, which
// costs less than a string of this script.
declare const WORKER: string;

/** Compiles a library while it is unpacked, without the round trips to other processes that a Blob takes. */
function compiled(text: string): Promise<WebAssembly.Module> {
  const { readable, writable } = new DecompressionStream("deflate");
  const writer = writable.getWriter();
  const read = atob(text);
  const packed = new Uint8Array(read.length);
  for (let i = 0; i < read.length; i++) packed[i] = read.charCodeAt(i);
  writer.write(packed).catch(() => undefined);
  writer.close().catch(() => undefined); // what fails is heard of where it is read
  return WebAssembly.compileStreaming(new Response(readable, { headers: { "Content-Type": "application/wasm" } }));
}

const VIEWS = ["motion", "diagram", "chart"] as const;

function tabs(app: App, enter: (view: string) => void): void {
  const buttons = VIEWS.map((view) => byId<HTMLButtonElement>(`tab-${view}`));
  buttons.forEach((button, i) => {
    button.addEventListener("click", () => app.change({ view: VIEWS[i] ?? "motion" }));
    button.addEventListener("keydown", (event) => {
      const to = { ArrowRight: i + 1, ArrowLeft: i + VIEWS.length - 1, Home: 0, End: VIEWS.length - 1 }[event.key];
      if (to === undefined) return;
      event.preventDefault();
      buttons[to % VIEWS.length]?.focus();
      buttons[to % VIEWS.length]?.click();
    });
  });
  const show = (): void => {
    enter(app.state.view);
    VIEWS.forEach((view, i) => {
      const on = view === app.state.view;
      byId(`view-${view}`).hidden = !on;
      buttons[i]?.setAttribute("aria-selected", String(on));
      buttons[i]?.setAttribute("tabindex", on ? "0" : "-1");
    });
    const refused = byId("refused");
    refused.hidden = !app.refused && !app.failed;
    refused.textContent = app.refused
      ? `The address was not understood: ${app.refused}. Shown are the defaults.`
      : app.failed && `A worker gave up (${app.failed}): what is shown is not whole. If it does so again, open the page by “capsule-sym explore --serve 0”.`;
  };
  app.listen(show);
  show();
}

async function begin(): Promise<void> {
  // The library is compiled beside, while the page is put up.
  const compiling = compiled(byId(`library-${SCENE}`).textContent);
  compiling.catch(() => undefined); // heard of below
  let code: WebAssembly.Module;
  const app = new App((failed) => new Pool(WORKER, code, failed));
  document.documentElement.classList.toggle("dark", app.theme.dark);
  measureType();
  // Views with workers are made when they are first entered.
  let diagram: DiagramPage | undefined;
  let chart: ChartPage | undefined;
  const enter = (view: string): void => {
    if (view === "diagram") diagram ??= new DiagramPage(app);
    if (view === "chart") chart ??= new ChartPage(app);
  };
  explainHeadings();
  sidebar(app);
  const motion = new MotionPage(app);
  code = await compiling;
  app.core = await Core.load(code);
  tabs(app, enter);
  if (app.state.view === "motion") motion.update();
  sharing(app, motion, () => ({ diagram: diagram?.panel, chart: chart?.panel }), () => diagram?.diagram, () => chart?.chart);
  fill(byId<HTMLSelectElement>("preset"), (state) => app.change(state));
  const theme = byId("theme");
  const press = (): void => theme.setAttribute("aria-pressed", String(app.theme.dark));
  theme.addEventListener("click", () => {
    app.setTheme(!app.theme.dark);
    press();
  });
  press();
  byId("take-tour").addEventListener("click", () => tour(() => app.change({ view: "motion" })));
  addEventListener("hashchange", ({ newURL }) => app.read(newURL.replace(/^[^#]*/, "")));
  addEventListener("resize", measureType);
  performance.mark("ready");
  document.documentElement.dataset["ready"] = "true";
}

begin().catch((error: unknown) => {
  byId("refused").hidden = false;
  byId("refused").textContent = `This browser cannot run the page: ${String(error)}`;
});
