// The column of parameters: dimensionless or of a device, and the start.
import type { App } from "../app.ts";
import { byId, make } from "../dom.ts";
import { DEVICE, ORIGIN, PARAMETERS } from "../fields.ts";
import { ABOUT, SCENE, SCENES } from "../scene.ts";
import { defaults } from "../state.ts";
import { choiceControl, numberControl } from "./controls.ts";
import { fileControl } from "./files.ts";

/** Inputs of every picture. */
export const PARTS = ["units", ...PARAMETERS, ...DEVICE, ...ORIGIN] as const;

export function sidebar(app: App): void {
  const change = app.change.bind(app);
  // Another scene loads the page again, at the same view.
  const scene = choiceControl("scene", "Scene", SCENES.map((name) => [name, name.replaceAll("_", " ")]), (value) => {
    location.hash = [["scene", value, SCENES[0]], ["view", app.state.view, "motion"]].flatMap(([name, one, plain]) => (one === plain ? [] : [`${name}=${one}`])).join("&");
    return "";
  });
  scene.show(SCENE);
  byId("scenes").append(scene.element, make("p", { class: "about" }, ABOUT(SCENE)));
  const units = choiceControl("units-choice", "Parameters", [["dimensionless", "dimensionless"], ["device", "a device, in SI units"]], (value) => change({ units: value }));
  byId("units").append(units.element, fileControl(app));
  const free = PARAMETERS.map((name) => numberControl(name, change));
  const device = DEVICE.map((name) => numberControl(name, change));
  const others = ([...ORIGIN, "periods"] as const).map((name) => numberControl(name, change));
  byId("controls").append(...[...free, ...device].map((one) => one.element));
  byId("starts").append(...others.map((one) => one.element));
  byId("reset").addEventListener("click", () => change({ ...defaults(), view: app.state.view }));
  // On a narrow screen the column is a drawer at the lower edge.
  const [drawer, fold] = [byId("parameters"), byId("fold")];
  fold.addEventListener("click", () => fold.setAttribute("aria-expanded", String(!drawer.classList.toggle("folded"))));
  const show = (): void => {
    const { state } = app;
    units.show(state.units);
    for (const one of free) one.element.hidden = state.units === "device";
    for (const one of device) one.element.hidden = state.units !== "device";
    for (const one of [...free, ...device, ...others]) one.show(state);
  };
  app.listen(show);
  show();
}
