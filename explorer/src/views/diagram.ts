// A bifurcation diagram drawn: points up, down and from further starts, and the events as lines.
import { FONT, UNIT, extent, frame, padded } from "../draw/axes.ts";
import type { Frame } from "../draw/axes.ts";
import type { Theme } from "../draw/colours.ts";
import type { Pen } from "../draw/svg.ts";
import type { Diagram, Place } from "../diagram.ts";
import { NUMBERS, QUANTITIES } from "../fields.ts";
import type { Quantity } from "../fields.ts";

/** Draws it, with the points of one column ringed if a place is chosen. */
export function drawDiagram(diagram: Diagram, quantity: Quantity, chosen: Place | null, pen: Pen, width: number, height: number, theme: Theme): Frame {
  const passes = diagram.passes.map((pass) => ({
    way: pass.way,
    points: pass.columns.flatMap((column, i) => {
      const x = pass.values[i] ?? 0;
      return column ? diagram.values(column, x, quantity).map((y) => [x, y] as const) : [];
    }),
  }));
  const all = passes.flatMap((pass) => pass.points.map(([, y]) => y)).filter(Number.isFinite);
  const ys = padded(all.length ? extent(all) : [0, 1]);
  const area = frame(pen, width, height, diagram.range, ys, [`${NUMBERS[diagram.x].name} ${NUMBERS[diagram.x].symbol}${diagram.plainly}`, `${QUANTITIES[quantity]}${diagram.plainly}`], theme);
  drawMarks(diagram, area, pen, theme);
  // Down as wide, light dots below those up, so that both are seen where they agree.
  const dense = Math.max(0.6, Math.min(1, (400 * (area.width / 900)) / (diagram.passes[0]?.values.length ?? 1)));
  for (const { way, points } of [...passes].reverse()) {
    pen.fillStyle = way === "up" ? theme.accent : way === "down" ? (theme.fields[5] ?? theme.mark) : theme.soft;
    const size = (way === "up" ? 2.2 : way === "down" ? 5.5 : 3) * dense * UNIT;
    for (const [x, y] of points) pen.fillRect(area.x(x) - size / 2, area.y(y) - size / 2, size, size);
  }
  if (chosen) ring(diagram, quantity, chosen, area, pen, theme);
  return area;
}

function ring(diagram: Diagram, quantity: Quantity, { pass, index }: Place, area: Frame, pen: Pen, theme: Theme): void {
  const { values, columns } = diagram.passes[pass] ?? { values: [], columns: [] };
  const [value, column] = [values[index] ?? 0, columns[index]];
  pen.strokeStyle = theme.ink;
  pen.lineWidth = UNIT;
  pen.beginPath();
  pen.moveTo(area.x(value), area.top);
  pen.lineTo(area.x(value), area.top + area.height);
  pen.stroke();
  pen.lineWidth = 1.5 * UNIT;
  for (const y of column ? diagram.values(column, value, quantity) : []) {
    pen.beginPath();
    pen.arc(area.x(value), area.y(y), 6 * UNIT, 0, 2 * Math.PI);
    pen.stroke();
  }
}

function drawMarks(diagram: Diagram, area: Frame, pen: Pen, theme: Theme): void {
  pen.font = FONT;
  pen.textBaseline = "top";
  let last = -Infinity;
  diagram.marks.forEach((mark, i) => {
    const x = area.x(mark.value);
    pen.strokeStyle = theme.mark;
    pen.lineWidth = UNIT;
    pen.setLineDash(mark.exact ? [] : [3, 3]);
    pen.globalAlpha = 0.7;
    pen.beginPath();
    pen.moveTo(x, area.top + 16 * UNIT);
    pen.lineTo(x, area.top + area.height);
    pen.stroke();
    pen.globalAlpha = 1;
    pen.setLineDash([]);
    const half = pen.measureText(String(i + 1)).width / 2;
    if (x - half < last + 4 * UNIT) return;
    last = x + half;
    pen.fillStyle = theme.mark;
    pen.textAlign = "center";
    pen.fillText(String(i + 1), x, area.top + 1);
  });
}
