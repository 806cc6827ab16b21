// Every value of the page's state: its range as the package has it, its default, and what it means.

import { DEVICE, MODEL, PARAMETERS, REACH, SCENES } from "./scene.ts";
import type { OwnField, Parameter, Quantity as DeviceQuantity } from "./scene.ts";

export { DEVICE, PARAMETERS };
export type { Parameter };

export interface NumberField {
  kind: "number";
  low: number;
  high: number;
  whole?: boolean;
  value: number;
  symbol: string;
  name: string;
  about: string;
  unit?: string;
  /** Unit of a device's value, where the field has none without a device. */
  si?: string;
  /** Ends of the slider, if it has one: a part of the range. */
  slider?: readonly [number, number, number];
}

export interface ChoiceField {
  kind: "choice";
  of: readonly string[];
  value: string;
  name: string;
}

const number = (
  symbol: string,
  name: string,
  range: readonly [number, number],
  value: number,
  about: string,
  more: Partial<NumberField> = {},
): NumberField => ({ kind: "number", symbol, name, low: range[0], high: range[1], value, about, ...more });

function ofParameters<Value>(take: (field: OwnField) => Value): Record<Parameter, Value> {
  return Object.fromEntries(PARAMETERS.map((name) => [name, take(MODEL.PARAMETER_FIELDS[name])])) as Record<Parameter, Value>;
}

const choice = (name: string, of: readonly string[], value = of[0] ?? ""): ChoiceField => ({
  kind: "choice",
  name,
  of,
  value,
});

export const STARTS = ["x_r", "v_r", "v_c"] as const;
/** Of each parameter its default. */
export const DEFAULTS = ofParameters((field) => field.value);

// Ranges of the paper; otherwise about the default.
const LOOKED: Record<string, readonly [number, number]> = {
  alpha: [0.005, 2], omega: [0.3, 1.6], delta: [0, 0.5], zeta: [0.01, 0.5], beta: [0, 10], gamma: [1, 5], f_b: [0.5, 1.5],
};
/** The values of each parameter over which a diagram or a chart begins. */
export const RANGES = Object.fromEntries(PARAMETERS.map((name) => {
  const { value, slider } = MODEL.PARAMETER_FIELDS[name];
  const [low, high] = LOOKED[name] ?? [0, 0];
  return [name, low < value && value < high ? [low, high] : value ? [value / 4, (5 * value) / 4] : [slider[0], slider[1]]];
})) as unknown as Record<Parameter, readonly [number, number]>;

const SIZE = 1e20;
const LOWS = Object.values(ofParameters((field) => field.low));
const HIGHS = Object.values(ofParameters((field) => field.high));
const ENDS = [Math.min(...LOWS), Math.max(...HIGHS)] as const;
const start = (symbol: string, name: string, about: string, si: string) =>
  number(symbol, name, [-SIZE, SIZE], 0, about, { slider: [-REACH, REACH, 0.01], si });

export const NUMBERS = {
  ...(MODEL.PARAMETER_FIELDS as Record<Parameter, NumberField>),
  ...(MODEL.DEVICE_FIELDS as Record<DeviceQuantity, NumberField>),
  x_r: start("x_r", "relative displacement at the start", "Displacement of the mass from the capsule, x_m − x_c.", "m"),
  v_r: start("v_r", "relative velocity at the start", "Velocity of the mass relative to the capsule, v_m − v_c.", "m/s"),
  v_c: start("v_c", "capsule's velocity at the start", "Exactly 0 where the capsule is at rest.", "m/s"),
  phase: number("τ₀", "phase at the start", [0, 2 * Math.PI * 1e6], 0,
    "Time at the start within the excitation period, in [0, 2π/ω). Where a diagram or a chart varies ω, whole periods are taken off.", { slider: [0, 1, 0.001], si: "s" }),
  periods: number("N", "periods settled", [1, 100000], 100,
    "Excitation periods that pass before the motion is drawn.", { whole: true, slider: [1, 1000, 1] }),
  d_from: number("from", "from", ENDS, RANGES.alpha[0], "Least value of the diagram's parameter."),
  d_to: number("to", "to", ENDS, RANGES.alpha[1], "Largest value of the diagram's parameter."),
  d_count: number("values", "values", [2, 2000], 400, "Values of the parameter between the two.", { whole: true }),
  d_periods: number("periods", "periods settled at each value", [1, 10000], 200, "Excitation periods at each value before points are drawn.", { whole: true }),
  d_starts: number("starts", "further starts at each value", [0, 16], 0, "Further starts at each value, from which motions that coexist are found.", { whole: true }),
  c_x0: number("from", "first axis from", [-SIZE, SIZE], RANGES.alpha[0], "Least value on the first axis."),
  c_x1: number("to", "first axis to", [-SIZE, SIZE], RANGES.alpha[1], "Largest value on the first axis."),
  c_y0: number("from", "second axis from", [-SIZE, SIZE], RANGES.gamma[0], "Least value on the second axis."),
  c_y1: number("to", "second axis to", [-SIZE, SIZE], RANGES.gamma[1], "Largest value on the second axis."),
  c_size: number("cells", "cells along an axis", [16, 512], 256, "Cells along each axis of the chart.", { whole: true }),
  around: number("turn", "turn of the state space", [-3600, 3600], -34, "Degrees about the v_c axis."),
  above: number("tilt", "tilt of the state space", [-86, 86], 24, "Degrees above the plane of rest."),
  c_periods: number("periods", "periods settled in each cell", [1, 10000], 300, "Excitation periods in each cell, at most; fewer where the motion is steady before.", { whole: true }),
} as const satisfies Record<string, NumberField>;

export const QUANTITIES = {
  x_r: "relative displacement x_r at phase 0",
  v_r: "relative velocity v_r at phase 0",
  v_c: "capsule velocity v_c at phase 0",
  impact: "relative velocity at impacts",
  progression: "progression per period",
  velocity: "average velocity",
  work: "work per period",
  stick: "share of time at rest",
  contact: "share of time in contact",
  period: "period number",
  multiplier: "largest Floquet multiplier |μ|",
} as const;
export type Quantity = keyof typeof QUANTITIES;

export const ORIGIN = [...STARTS, "phase"] as const;
export type Origin = (typeof ORIGIN)[number];
export const AXES = [...PARAMETERS, ...ORIGIN] as const;
export type Axis = (typeof AXES)[number];

export const CHOICES = {
  scene: choice("scene", SCENES),
  view: choice("view", ["motion", "diagram", "chart"]),
  units: choice("units", ["dimensionless", "device"]),
  d_x: choice("parameter", PARAMETERS),
  d_y: choice("quantity", Object.keys(QUANTITIES)),
  d_way: choice("directions", ["both", "up", "down"]),
  c_x: choice("first axis", AXES),
  c_y: choice("second axis", AXES, "gamma"),
  c_by: choice("colour by", ["itinerary", "progression", "period", "attractor"]),
  plane: choice("plane", ["x_r-v_r", "x_r-v_c", "v_r-v_c"]),
} as const satisfies Record<string, ChoiceField>;

export type NumberName = keyof typeof NUMBERS;
export type ChoiceName = keyof typeof CHOICES;

/** A number's field, by its name. */
export const field = (name: NumberName): NumberField => NUMBERS[name];
