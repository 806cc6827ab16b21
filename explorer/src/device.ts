// A device in SI units: its scales and its dimensionless parameters, as in Section 2 of the paper.
import { DEFAULTS } from "./fields.ts";
import type { DeviceName, Parameter } from "./fields.ts";

export type Device = Record<DeviceName, number>;

export interface Scales {
  /** N, s and m: the units of force, time and length. */
  force: number;
  time: number;
  length: number;
}

export function scales(d: Device): Scales {
  const force = d.mu * (d.M_m + d.M_c) * d.g;
  return { force, time: 1 / Math.sqrt(d.k1 / d.M_m), length: force / d.k1 };
}

/** A unit in which something is shown: what the number without units is multiplied by, and its name. */
export interface Unit {
  factor: number;
  name: string;
}
export type Units = Record<"length" | "velocity" | "time" | "energy", Unit>;

const NONE: Unit = { factor: 1, name: "" };
export const PLAIN_UNITS: Units = { length: NONE, velocity: NONE, time: NONE, energy: NONE };

/** The units in which a device's motion is shown. */
export function unitsOf(d: Device): Units {
  const { force, time, length } = scales(d);
  return {
    length: { factor: 1e3 * length, name: "mm" },
    velocity: { factor: (1e3 * length) / time, name: "mm/s" },
    time: { factor: time, name: "s" },
    energy: { factor: 1e3 * force * length, name: "mJ" },
  };
}

/** A name with its unit, if it has one. */
export const withUnit = (name: string, unit: Unit): string => (unit.name ? `${name} (${unit.name})` : name);

export function dimensionless(d: Device): Record<Parameter, number> {
  const friction = d.mu * (d.M_m + d.M_c) * d.g;
  const natural = Math.sqrt(d.k1 / d.M_m);
  return {
    ...DEFAULTS,
    alpha: d.P_d / friction,
    omega: d.Omega / natural,
    delta: (d.k1 * d.G) / friction,
    zeta: d.c / (d.M_m * natural) / 2,
    beta: d.k2 / d.k1,
    gamma: d.M_c / d.M_m,
    f_b: 1,
  };
}

/** Whether the device's scales can be represented; "" or what is wrong. */
export function problem(d: Device): string {
  const { force, time, length } = scales(d);
  const fine = [force, time, length].every((value) => Number.isFinite(value) && value > 0);
  return fine ? "" : "the device's scales of force, time and length must be finite and > 0";
}
