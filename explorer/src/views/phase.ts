// The phase portrait of one motion, each segment in its field's colour, the impact surface, the switches.
import { POINT } from "../core.ts";
import { withUnit } from "../device.ts";
import type { Unit } from "../device.ts";
import { fieldColour } from "../draw/colours.ts";
import { edgeOf } from "../itinerary.ts";
import { stops } from "../scene.ts";
import { FONT, UNIT, extent, frame, maths, padded } from "../draw/axes.ts";
import type { Frame } from "../draw/axes.ts";
import type { Theme } from "../draw/colours.ts";
import type { Pen } from "../draw/svg.ts";
import type { Motion } from "../motion.ts";

export const PLANES = [
  { name: "x_r – v_r", x: 2, y: 3 },
  { name: "x_r – v_c", x: 2, y: 4 },
  { name: "v_r – v_c", x: 3, y: 4 },
] as const;
const NAMES = ["", "", "x_r", "v_r", "v_c"] as const;

export function drawPhase(motion: Motion, plane: number, pen: Pen, width: number, height: number, theme: Theme): void {
  const { x, y } = PLANES[plane] ?? PLANES[0];
  const unit = (k: number): Unit => (k === 2 ? motion.units.length : motion.units.velocity);
  const at = (k: number): number[] => column(motion.points, k).map((value) => value * unit(k).factor);
  const [xs, ys] = [at(x), at(y)];
  const surfaces = x === 2 ? stops(motion.parameters) : [];
  const placed = surfaces.map(({ gap, side }) => side * gap * motion.units.length.factor);
  const area = frame(pen, width, height, padded(extent([...xs, ...placed])), padded(extent(ys)), [withUnit(NAMES[x], unit(x)), withUnit(NAMES[y], unit(y))], theme);
  surfaces.forEach(({ side, symbol }, k) => {
    const at = area.x(placed[k] ?? 0);
    pen.strokeStyle = theme.soft;
    pen.lineWidth = 1;
    pen.setLineDash([5, 4]);
    line(pen, [[at, area.top], [at, area.top + area.height]]);
    pen.setLineDash([]);
    pen.font = FONT;
    pen.fillStyle = theme.soft;
    pen.textAlign = side > 0 ? "right" : "left";
    pen.textBaseline = "top";
    maths(pen, `x_r = ${symbol}`, at - 5 * side, area.top + 3);
  });
  drawSegments(motion, xs, ys, area, pen, theme);
}

function drawSegments(motion: Motion, xs: readonly number[], ys: readonly number[], area: Frame, pen: Pen, theme: Theme): void {
  pen.lineWidth = 2.25 * UNIT;
  pen.lineCap = "round";
  eachSegment(motion, (field, from, to) => {
    pen.strokeStyle = fieldColour(field, theme);
    pen.beginPath();
    for (let i = from; i < to; i++) {
      const [px, py] = [area.x(xs[i] ?? 0), area.y(ys[i] ?? 0)];
      if (i === from) pen.moveTo(px, py);
      else pen.lineTo(px, py);
    }
    pen.stroke();
  });
  pen.lineCap = "butt";
  pen.lineWidth = 1.25 * UNIT;
  pen.strokeStyle = theme.ink;
  let before = 0;
  eachSegment(motion, (field, from) => {
    pen.fillStyle = from && edgeOf(before, field) ? theme.ink : theme.paper;
    before = field;
    if (from === 0) return;
    pen.beginPath();
    pen.arc(area.x(xs[from] ?? 0), area.y(ys[from] ?? 0), 3 * UNIT, 0, 2 * Math.PI);
    pen.fill();
    pen.stroke();
  });
}

/** Every segment's field, and its points: from the first to before the last index. */
export function eachSegment(motion: Motion, visit: (field: number, from: number, to: number) => void): void {
  const { points, segments } = motion;
  const n = points.length / POINT;
  for (let from = 0; from < n; ) {
    const segment = points[from * POINT];
    let to = from + 1;
    while (to < n && points[to * POINT] === segment) to++;
    visit(segments[segment ?? 0]?.field ?? 1, from, to);
    from = to;
  }
}

export function column(points: Float64Array, k: number): number[] {
  const values = new Array<number>(points.length / POINT);
  for (let i = 0; i < values.length; i++) values[i] = points[i * POINT + k] ?? NaN;
  return values;
}

function line(pen: Pen, places: readonly (readonly [number, number])[]): void {
  pen.beginPath();
  places.forEach(([x, y], i) => (i ? pen.lineTo(x, y) : pen.moveTo(x, y)));
  pen.stroke();
}
