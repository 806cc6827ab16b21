// What can be taken along: the state as Python, as a command line, as a device's file; a motion as CSV.
import { DEVICE, PARAMETERS } from "../fields.ts";
import { POINT } from "../core.ts";
import type { Motion } from "../motion.ts";
import { defaults, parameters } from "../state.ts";
import type { State } from "../state.ts";

const plain = defaults();
const started = (state: State): boolean => state.x_r !== 0 || state.v_r !== 0 || state.v_c !== 0;
const float = (value: number): string => {
  const text = String(value);
  return /[.e]/.test(text) ? text : `${text}.0`;
};

export function asPython(state: State): string {
  const p = parameters(state);
  const device = state.units === "device";
  const given = device
    ? DEVICE.map((name) => `${name}=${float(state[name])}`)
    : PARAMETERS.filter((name) => p[name] !== plain[name]).map((name) => `${name}=${float(p[name])}`);
  const more = [
    ...(started(state) ? [`state=(${float(state.x_r)}, ${float(state.v_r)}, ${float(state.v_c)})`] : []),
    ...(state.phase ? [`phase=${float(state.phase)}`] : []),
    `periods=${state.periods}`,
  ].join(", ");
  const made = device ? `PhysicalParameters(${given.join(", ")}).dimensionless()` : `Parameters(${given.join(", ")})`;
  const name = device ? "PhysicalParameters, simulate" : "Parameters, simulate";
  return `from capsule_sym import ${name}\n\ntrajectory = simulate(${made}, ${more})\nmotion = trajectory.steady()\nprint(motion.global_map, motion.progression)\n`;
}

export function asCommand(state: State): string {
  const p = parameters(state);
  const flags = state.units === "device"
    ? ["--params device.toml"]
    : PARAMETERS.filter((name) => p[name] !== plain[name]).map((name) => `--${name === "f_b" ? "fb" : name} ${p[name]}`);
  if (started(state)) flags.push(`--state ${state.x_r} ${state.v_r} ${state.v_c}`);
  if (state.phase) flags.push(`--phase ${state.phase}`);
  flags.push(`--periods ${state.periods}`);
  return `capsule-sym run ${flags.join(" ")}\n`;
}

/** A TOML file for --params: the device in SI units, or the dimensionless parameters. */
export function asFile(state: State): string {
  const names = state.units === "device" ? DEVICE : PARAMETERS;
  return names.map((name) => `${name} = ${float(state[name])}\n`).join("");
}

export function pointsCsv(motion: Motion): string {
  const rows = ["segment,field,time,x_r,v_r,v_c,x_c"];
  for (let i = 0; i < motion.points.length; i += POINT) {
    const [segment = 0, time, x, v, w, place] = motion.points.subarray(i, i + POINT);
    rows.push([segment, motion.segments[segment]?.field, time, x, v, w, place].join(","));
  }
  return `${rows.join("\n")}\n`;
}

export function segmentsCsv(motion: Motion): string {
  const rows = ["field,source,target,outcome,duration,start_x_r,start_v_r,start_v_c,end_x_r,end_v_r,end_v_c,decided_in_106_bits"];
  for (const s of motion.cycle)
    rows.push([`F${s.field}`, `Σ${s.source}`, `Σ${s.target}`, s.outcome, s.duration, ...s.start, ...s.end, s.wide].join(","));
  return `${rows.join("\n")}\n`;
}
