// The capsule itself: mass, springs, contact, drive, friction and drift at one time of the motion.
import { contact, drift } from "../itinerary.ts";
import { POINT } from "../core.ts";
import { FONT, UNIT, extent, maths } from "../draw/axes.ts";
import { fieldColour } from "../draw/colours.ts";
import type { Theme } from "../draw/colours.ts";
import type { Pen } from "../draw/svg.ts";
import type { Motion } from "../motion.ts";
import { MODEL, MODES, REACTS, bound, driveAt, highest, stops } from "../scene.ts";

const STEEPEST = 0.07; // slope that is drawn, in radians

export interface Now {
  x_r: number;
  v_r: number;
  v_c: number;
  x_c: number;
  force: number;
  drive: number;
  field: number;
}

/** The motion at a share of what is drawn, in [0, 1), after so many repetitions. */
export function nowAt(motion: Motion, share: number, rounds: number): Now {
  const { points, segments } = motion;
  const n = points.length / POINT;
  const total = motion.turns * motion.period;
  const time = share * total;
  let [low, high] = [0, Math.max(0, n - 1)];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if ((points[middle * POINT + 1] ?? 0) <= time) low = middle;
    else high = middle;
  }
  const at = (i: number, k: number): number => points[i * POINT + k] ?? 0;
  const [a, b] = [at(low, 1), at(high, 1)];
  const t = b > a ? Math.min(1, Math.max(0, (time - a) / (b - a))) : 0;
  const mix = (k: number): number => at(low, k) + t * (at(high, k) - at(low, k));
  const drift = motion.progression * motion.turns * rounds;
  return { x_r: mix(2), v_r: mix(3), v_c: mix(4), x_c: mix(5) + drift, force: mix(6), drive: driveAt(motion.parameters, (share * motion.turns) % 1), field: segments[at(low, 0)]?.field ?? 2 };
}

export function drawCapsule(motion: Motion, now: Now, pen: Pen, width: number, height: number, theme: Theme): void {
  const xs = extent(columnOf(motion, 2));
  const p = motion.parameters;
  const springs = stops(p);
  const reach = Math.max(Math.abs(xs[0]), Math.abs(xs[1]), ...springs.map(({ gap }) => gap * 1.5), 0.3);
  const length = Math.min(width * 0.56, 520 * UNIT);
  const scale = (length * 0.27) / reach;
  const floor = height - 34 * UNIT;
  const tall = Math.min(110 * UNIT, floor - 26 * UNIT);
  const centre = width / 2;
  const [left, right, top] = [centre - length / 2, centre + length / 2, floor - tall - 6];
  const colour = fieldColour(now.field, theme);

  pen.save();
  if (MODEL.LOAD) {
    // A load is a slope, drawn steeper than it is, and never steep.
    pen.translate(centre, floor);
    pen.rotate(-STEEPEST * Math.tanh((p[MODEL.LOAD] * (1 + p.gamma)) / STEEPEST));
    pen.translate(-centre, -floor);
  }
  ground(pen, now.x_c * scale, width, floor, theme);

  // Capsule.
  pen.fillStyle = theme.dark ? "#1d2732" : "#f3f6f9";
  pen.strokeStyle = theme.ink;
  pen.lineWidth = 2 * UNIT;
  pill(pen, left, top, length, tall);
  pen.fill();
  pen.stroke();
  pen.fillStyle = theme.ink;
  for (const x of [left + length * 0.2, right - length * 0.2]) {
    pen.beginPath();
    pen.rect(x - 14, floor - 7, 28, 7);
    pen.fill();
  }

  // Mass at x_r, and stops a gap away from where it rests; the spring is above that of a stop behind.
  const half = Math.min(30 * UNIT, tall * 0.3);
  const x = centre + now.x_r * scale;
  const y = top + tall / 2 + (REACTS ? 4 : 0);
  const side = [0, 1, -1][contact(now.field)];
  const aside = springs.length > 1 ? half * 0.45 : 0;
  pen.strokeStyle = theme.soft;
  pen.lineWidth = 1.75 * UNIT;
  spring(pen, left + 12, x - half, y - aside, 9, 9);
  for (const stop of springs) {
    const met = stop.side === side;
    const plate = met ? x + side * half : centre + stop.side * (half + stop.gap * scale);
    const wall = stop.side > 0 ? right - 12 : left + 12;
    const [high, low] = stop.side > 0 ? [0.8, 0.8] : [-0.05, 0.95];
    pen.strokeStyle = met ? theme.mark : theme.soft;
    pen.lineWidth = 1.75 * UNIT;
    spring(pen, plate + 3 * stop.side, wall, y + (stop.side > 0 ? 0 : aside), 7, stop.side > 0 ? 9 : 7);
    pen.lineWidth = 3.5 * UNIT;
    pen.beginPath();
    pen.moveTo(plate + 2 * stop.side, y - half * high);
    pen.lineTo(plate + 2 * stop.side, y + half * low);
    pen.stroke();
  }
  pen.fillStyle = colour;
  pen.beginPath();
  pen.rect(x - half, y - half, 2 * half, 2 * half);
  pen.fill();
  pen.strokeStyle = theme.ink;
  pen.lineWidth = 1;
  pen.strokeRect(x - half, y - half, 2 * half, 2 * half);

  // The drive on the mass, and where it pushes back the same on the capsule.
  const push = (now.drive / (highest(p) || 1)) * length * 0.14;
  pen.strokeStyle = pen.fillStyle = theme.soft;
  arrow(pen, x, y - half - 8 * UNIT, push);
  if (REACTS) arrow(pen, centre, top + 7 * UNIT, -push);

  friction(pen, motion, now, centre, floor, length, theme);
  pen.restore();
  pen.font = FONT;
  pen.textBaseline = "top";
  pen.textAlign = "left";
  pen.fillStyle = theme.ink;
  const unit = motion.units.length;
  pen.fillText(`F${now.field}  ${MODES[now.field - 1] ?? ""}`, 12, 8);
  pen.textAlign = "right";
  maths(pen, `x_c = ${(now.x_c * unit.factor).toFixed(3).replace("-", "−")} ${unit.name}`.trim(), width - 12, 8);
}

function columnOf(motion: Motion, k: number): number[] {
  const values: number[] = [];
  for (let i = k; i < motion.points.length; i += POINT) values.push(motion.points[i] ?? 0);
  return values;
}

/** The floor, with marks that move past the capsule as it drifts. */
function ground(pen: Pen, moved: number, width: number, floor: number, theme: Theme): void {
  pen.strokeStyle = theme.soft;
  pen.lineWidth = 1.5;
  pen.beginPath();
  const gap = 24;
  pen.moveTo(-gap, floor);
  pen.lineTo(width + gap, floor);
  for (let x = -((moved % gap) + gap) % gap; x < width + gap; x += gap) {
    pen.moveTo(x, floor);
    pen.lineTo(x - 8, floor + 8);
  }
  pen.stroke();
}

function friction(pen: Pen, { parameters: p }: Motion, now: Now, centre: number, floor: number, length: number, theme: Theme): void {
  const sliding = drift(now.field);
  const pull = now.force - (REACTS ? now.drive : 0);
  const force = sliding ? -sliding * bound(p, sliding) : -Math.max(-bound(p, -1), Math.min(bound(p, 1), pull));
  const size = (force / Math.max(bound(p, 1), bound(p, -1))) * length * 0.16;
  pen.strokeStyle = pen.fillStyle = theme.mark;
  arrow(pen, centre, floor + 17 * UNIT, size);
  pen.font = FONT;
  pen.fillStyle = theme.soft;
  pen.textBaseline = "middle";
  pen.textAlign = size > 0 ? "right" : "left";
  pen.fillText(MODEL.LOAD ? "friction and weight" : "friction", centre + (size > 0 ? -8 : 8), floor + 18 * UNIT);
  if (!sliding) return;
  pen.strokeStyle = pen.fillStyle = theme.accent;
  arrow(pen, centre + sliding * length * 0.52, floor - 34, Math.sign(now.v_c) * Math.min(46, 8 + Math.abs(now.v_c) * 46));
}

function arrow(pen: Pen, x: number, y: number, size: number): void {
  if (Math.abs(size) < 2) return;
  const way = Math.sign(size);
  pen.lineWidth = 2.5 * UNIT;
  pen.beginPath();
  pen.moveTo(x, y);
  pen.lineTo(x + size, y);
  pen.stroke();
  pen.beginPath();
  pen.moveTo(x + size + 5 * way, y);
  pen.lineTo(x + size - 4 * way, y - 5);
  pen.lineTo(x + size - 4 * way, y + 5);
  pen.closePath();
  pen.fill();
}

function spring(pen: Pen, from: number, to: number, y: number, turns: number, high: number): void {
  const step = (to - from) / (turns + 2);
  pen.beginPath();
  pen.moveTo(from, y);
  for (let i = 1; i <= turns; i++) pen.lineTo(from + step * (i + 0.5), y + (i % 2 ? -high : high));
  pen.lineTo(to - step * 0.5, y);
  pen.lineTo(to, y);
  pen.stroke();
}

/** A rectangle with half-round ends, by lines. */
function pill(pen: Pen, x: number, y: number, w: number, h: number): void {
  const r = Math.min(h / 2, 34 * UNIT);
  const corner = (cx: number, cy: number, from: number): void => {
    for (let i = 0; i <= 8; i++) {
      const a = from + (i / 8) * (Math.PI / 2);
      pen.lineTo(cx + r * Math.cos(a), cy + r * Math.sin(a));
    }
  };
  pen.beginPath();
  pen.moveTo(x + r, y);
  corner(x + w - r, y + r, -Math.PI / 2);
  corner(x + w - r, y + h - r, 0);
  corner(x + r, y + h - r, Math.PI / 2);
  corner(x + r, y + r, Math.PI);
  pen.closePath();
}
