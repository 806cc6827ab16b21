// The dialog from which state, motion and pictures are taken along.
import type { App } from "../app.ts";
import type { Chart } from "../chart.ts";
import type { Diagram } from "../diagram.ts";
import { byId, download, make } from "../dom.ts";
import type { Panel } from "../draw/panel.ts";
import type { Quantity } from "../fields.ts";
import { written } from "../itinerary.ts";
import type { MotionPage } from "../pages/motion.ts";
import { asCommand, asFile, asPython, fileTitle, pointsCsv, segmentsCsv } from "./share.ts";

type Views = () => { diagram: Panel | undefined; chart: Panel | undefined };

export function sharing(app: App, motion: MotionPage, views: Views, diagram: () => Diagram | undefined, chart: () => Chart | undefined): void {
  const dialog = byId<HTMLDialogElement>("share");
  byId("share-open").addEventListener("click", () => {
    byId("share-body").replaceChildren(
      copied("Address", "share-address", app.address),
      copied("Python", "share-python", asPython(app.state, Boolean(motion.motion?.globalMap))),
      copied("Command line", "share-command", asCommand(app.state)),
      copied(fileTitle(app.state), "share-file", asFile(app.state)),
      make("div", { class: "item" }, make("h3", {}, "Save"), make("div", { class: "row" }, ...saves())),
    );
    dialog.showModal();
  });

  function saves(): HTMLElement[] {
    const save = (name: string, act: () => void): HTMLElement => make("button", { type: "button", id: `save-${name.replace(/\W+/g, "-")}`, click: act }, name);
    const { view } = app.state;
    if (view !== "motion") {
      const panel = views()[view as "diagram" | "chart"];
      const found = diagram();
      const cells = chart();
      return [
        ...(panel ? [save("picture.svg", () => download(`${view}.svg`, panel.svg(`capsule-sym ${view}`), "image/svg+xml")), save("picture.png", () => png(panel.canvas, `${view}.png`))] : []),
        ...(view === "diagram" && found ? [save("points.csv", () => download("diagram.csv", diagramCsv(found, app.state.d_y as Quantity), "text/csv")), save("bifurcations.csv", () => download("bifurcations.csv", marksCsv(found), "text/csv"))] : []),
        ...(view === "chart" && cells ? [save("cells.csv", () => download("chart.csv", chartCsv(cells), "text/csv"))] : []),
      ];
    }
    const shown = motion.motion;
    if (!shown) return [];
    return [
      save("points.csv", () => download("points.csv", pointsCsv(shown), "text/csv")),
      save("segments.csv", () => download("segments.csv", segmentsCsv(shown), "text/csv")),
      ...["history", "phase", "space", "capsule"].flatMap((name) => [
        save(`${name}.svg`, () => download(`${name}.svg`, motion.svgs()[name] ?? "", "image/svg+xml")),
        save(`${name}.png`, () => png(motion.panels[name]?.canvas ?? byId(name).querySelector("canvas"), `${name}.png`)),
      ]),
    ];
  }

  /** A picture as it is on the screen, on the colour of its card. */
  function png(canvas: HTMLCanvasElement | null, name: string): void {
    if (!canvas) return;
    const copy = document.createElement("canvas");
    [copy.width, copy.height] = [canvas.width, canvas.height];
    const pen = copy.getContext("2d");
    if (!pen) return;
    pen.fillStyle = app.theme.paper;
    pen.fillRect(0, 0, copy.width, copy.height);
    pen.drawImage(canvas, 0, 0);
    copy.toBlob((blob) => blob && download(name, blob));
  }
}

function copied(title: string, id: string, text: string): HTMLElement {
  const button = make("button", { type: "button" }, "Copy");
  button.addEventListener("click", () => {
    const done = (): void => {
      button.textContent = "Copied";
    };
    const selected = (): void => {
      const range = document.createRange();
      range.selectNodeContents(byId(id));
      getSelection()?.removeAllRanges();
      getSelection()?.addRange(range);
      button.textContent = "Selected";
    };
    if (navigator.clipboard) navigator.clipboard.writeText(text).then(done, selected);
    else selected();
  });
  return make("div", { class: "item" }, make("div", { class: "card-head" }, make("h3", {}, title), button), make("pre", { id, tabindex: "0", "aria-label": title }, text));
}

function diagramCsv(diagram: Diagram, quantity: Quantity): string {
  const rows = [`direction,${diagram.x},${quantity},period_number,itinerary`];
  for (const pass of diagram.passes)
    pass.columns.forEach((column, i) => {
      const x = pass.values[i] ?? 0;
      if (!column) return;
      for (const y of diagram.values(column, x, quantity)) rows.push([pass.way, x, y, column.periodNumber, written(column.fields)].join(","));
    });
  return `${rows.join("\n")}\n`;
}

function chartCsv(chart: Chart): string {
  const rows = [`${chart.x},${chart.y},itinerary,period_number,progression,run`];
  for (let j = 0; j < chart.size; j++)
    for (let i = 0; i < chart.size; i++) {
      const k = j * chart.size + i;
      const region = chart.regions[chart.of[k] ?? -1];
      // True if the cell was run itself, not filled in between equal ones.
      rows.push([...chart.place(i, j), region?.itinerary ?? "", region?.periodNumber ?? "", chart.progressions[k], chart.known[k] === 1].join(","));
    }
  return `${rows.join("\n")}\n`;
}

const marksCsv = (diagram: Diagram): string =>
  [`${diagram.x},uncertainty,exact,event,below,above`, ...diagram.marks.map((m) => [m.value, m.doubt, m.exact, m.name, m.before, m.after].join(","))].join("\n") + "\n";
