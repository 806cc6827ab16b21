// The motion in its state space (x_r, v_r, v_c), with the impact surface and the plane of rest.
import { FONT, MATHS, UNIT, extent, maths, padded } from "../draw/axes.ts";
import type { Range } from "../draw/axes.ts";
import { fieldColour } from "../draw/colours.ts";
import type { Theme } from "../draw/colours.ts";
import type { Pen } from "../draw/svg.ts";
import type { Motion } from "../motion.ts";
import { REACTS, bound, driveAt, stops } from "../scene.ts";
import type { Parameter } from "../scene.ts";
import { column, eachSegment } from "./phase.ts";

export interface Turn {
  around: number;
  above: number;
}

type Point = readonly [number, number, number];

export function drawSpace(motion: Motion, turn: Turn, pen: Pen, width: number, height: number, theme: Theme): void {
  const states = [2, 3, 4].map((k) => column(motion.points, k));
  const surfaces = stops(motion.parameters).map(({ gap, side, symbol }) => ({ place: side * gap, symbol }));
  const ranges = states.map((values, k) => padded(extent(k === 0 ? [...values, ...surfaces.map(({ place }) => place)] : k === 2 ? [...values, 0] : values), 0.08));
  const [xs, vs, cs] = ranges as [Range, Range, Range];
  const [ca, sa, cb, sb] = [Math.cos(turn.around), Math.sin(turn.around), Math.cos(turn.above), Math.sin(turn.above)];
  const size = Math.min(width, height * 1.25) * 0.5;
  const unit = (value: number, [low, high]: Range): number => ((value - low) / (high - low)) * 2 - 1;
  const flat = ([x, v, c]: Point): [number, number] => {
    const [a, b, h] = [unit(x, xs), unit(v, vs), unit(c, cs) * 0.8];
    const [right, deep] = [a * ca - b * sa, a * sa + b * ca];
    return [width / 2 + right * size * 0.68, height / 2 - (h * cb + deep * sb) * size * 0.62];
  };
  const path = (points: readonly Point[], close = false): void => {
    pen.beginPath();
    points.forEach((point, i) => {
      const [px, py] = flat(point);
      if (i) pen.lineTo(px, py);
      else pen.moveTo(px, py);
    });
    if (close) pen.closePath();
  };
  const corners = (along: (a: number, b: number) => Point): Point[] => [along(0, 0), along(1, 0), along(1, 1), along(0, 1)];

  // The box.
  pen.strokeStyle = theme.line;
  pen.lineWidth = 1;
  for (const [i, j, k] of [[0, 1, 2], [1, 0, 2], [2, 0, 1]] as const)
    for (const a of [0, 1] as const)
      for (const b of [0, 1] as const) {
        const end = (t: 0 | 1): Point => {
          const at = [0, 0, 0];
          at[i] = ranges[i]?.[t] ?? 0;
          at[j] = ranges[j]?.[a] ?? 0;
          at[k] = ranges[k]?.[b] ?? 0;
          return at as unknown as Point;
        };
        path([end(0), end(1)]);
        pen.stroke();
      }

  // Surfaces: those of the stops, and v_c = 0 where the capsule can rest.
  pen.strokeStyle = theme.soft;
  const surface = (points: readonly Point[], colour: string, dash: number[]): void => {
    path(points, true);
    pen.globalAlpha = 0.16;
    pen.fillStyle = colour;
    pen.fill();
    pen.globalAlpha = 1;
    pen.setLineDash(dash);
    pen.stroke();
    pen.setLineDash([]);
  };
  for (const { place } of surfaces) surface(corners((a, b) => [place, vs[a as 0 | 1], cs[b as 0 | 1]]), theme.accent, [4, 3]);
  for (const rest of restRegion(xs, vs, motion.parameters)) surface(rest.map(([x, v]): Point => [x, v, 0]), theme.soft, []);

  pen.lineWidth = 2.25 * UNIT;
  pen.lineCap = "round";
  eachSegment(motion, (field, from, to) => {
    pen.strokeStyle = fieldColour(field, theme);
    const points: Point[] = [];
    for (let i = from; i < to; i++) points.push([states[0]?.[i] ?? 0, states[1]?.[i] ?? 0, states[2]?.[i] ?? 0]);
    path(points);
    pen.stroke();
  });
  pen.lineCap = "butt";

  pen.fillStyle = theme.ink;
  pen.font = MATHS;
  pen.textAlign = "center";
  pen.textBaseline = "middle";
  // Names beside the edges that are in front.
  const middle = ([low, high]: Range): number => (low + high) / 2;
  const front = (one: Point, other: Point): Point => (flat(one)[1] > flat(other)[1] ? one : other);
  const side = ([vs[0], vs[1]] as const).flatMap((v) => ([xs[0], xs[1]] as const).map((x): Point => [x, v, middle(cs)]));
  const left = side.reduce((best, one) => (flat(one)[0] < flat(best)[0] ? one : best));
  for (const [name, point, dx, dy] of [
    ["x_r", front([middle(xs), vs[0], cs[0]], [middle(xs), vs[1], cs[0]]), 0, 18],
    ["v_r", front([xs[0], middle(vs), cs[0]], [xs[1], middle(vs), cs[0]]), 0, 18],
    ["v_c", left, -16, 0],
  ] as const) {
    const [px, py] = flat(point);
    maths(pen, name, Math.max(12 * UNIT, px + dx * UNIT), Math.min(height - 10 * UNIT, py + dy * UNIT));
  }
  pen.font = FONT;
  pen.fillStyle = theme.soft;
  for (const { place, symbol } of surfaces) {
    const [lx, ly] = flat([place, vs[1], cs[1]]);
    maths(pen, `x_r = ${symbol}`, lx, ly - 9 * UNIT);
  }
}

/** The part of the plane v_c = 0 in which the friction holds the capsule: a polygon between any two stops, or beyond one. */
function restRegion([x0, x1]: Range, [v0, v1]: Range, p: Record<Parameter, number>): [number, number][][] {
  const springs = stops(p);
  // A drive that reacts moves it: drawn is where it is at phase 0.
  const drive = REACTS ? driveAt(p, 0) : 0;
  const pull = (x: number, v: number): number =>
    springs.reduce((sum, { gap, stiffness, side }) => sum + side * stiffness * Math.max(0, side * x - gap), x + 2 * p.zeta * v - drive);
  const ends = [x0, ...springs.map(({ gap, side }) => Math.min(Math.max(side * gap, x0), x1)).sort((a, b) => a - b), x1];
  const parts = ends.slice(1).map((right, i): [number, number][] => [[ends[i] ?? x0, v0], [ends[i] ?? x0, v1], [right, v1], [right, v0]]);
  return parts
    .map((part) => [1, -1].reduce((kept, way) => cut(kept, (x, v) => bound(p, way) - way * pull(x, v)), part))
    .filter(({ length }) => length > 2);
}

/** The part of a polygon in which a function, linear along its edges, is not negative. */
function cut(polygon: readonly [number, number][], inside: (x: number, v: number) => number): [number, number][] {
  const kept: [number, number][] = [];
  polygon.forEach((here, i) => {
    const next = polygon[(i + 1) % polygon.length] ?? here;
    const [a, b] = [inside(...here), inside(...next)];
    if (a >= 0) kept.push(here);
    if (a * b < 0) {
      let [low, high] = [0, 1];
      for (let k = 0; k < 40; k++) {
        const t = (low + high) / 2;
        if (inside(here[0] + t * (next[0] - here[0]), here[1] + t * (next[1] - here[1])) * a > 0) low = t;
        else high = t;
      }
      kept.push([here[0] + low * (next[0] - here[0]), here[1] + low * (next[1] - here[1])]);
    }
  });
  return kept;
}
