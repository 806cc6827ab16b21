// What can be taken along: the state as Python, as a command line, as a device's file; a motion as CSV.
import { DEVICE, ORIGIN, PARAMETERS } from "../fields.ts";
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
  if (state.view !== "motion")
    return `import tomllib\n\nfrom capsule_sym import open_results, read_plan, run_sweep\n\nplan = tomllib.loads('''\n${asFile(state)}''')\nrun_sweep(read_plan(plan), "sweep")\nresults = open_results("sweep")\nprint(results)\n`;
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
  if (state.view !== "motion") return `capsule-sym sweep sweep.toml --store sweep${state.view === "chart" ? " --refine 16" : ""}\n`;
  const p = parameters(state);
  const flags = state.units === "device"
    ? ["--params device.toml"]
    : PARAMETERS.filter((name) => p[name] !== plain[name]).map((name) => `--${name === "f_b" ? "f-b" : name} ${p[name]}`);
  if (started(state)) flags.push(`--state ${state.x_r} ${state.v_r} ${state.v_c}`);
  if (state.phase) flags.push(`--phase ${state.phase}`);
  flags.push(`--periods ${state.periods}`);
  return `capsule-sym run ${flags.join(" ")}\n`;
}

/** What the file is. */
export const fileTitle = (state: State): string =>
  state.view !== "motion" ? "File of the sweep, sweep.toml: every value run from the start"
  : state.units === "device" ? "File of the device, device.toml" : "File of the parameters, for --params";

/** A TOML file for --params: the device in SI units, or the dimensionless parameters. Of a view of many motions that for a sweep. */
export function asFile(state: State): string {
  if (state.view !== "motion") return sweepFile(state);
  const names = state.units === "device" ? DEVICE : PARAMETERS;
  return names.map((name) => `${name} = ${float(state[name])}\n`).join("");
}

function sweepFile(state: State): string {
  const axis = (name: string, low: number, high: number, count: number): string =>
    `${name} = { from = ${float(low)}, to = ${float(high)}, count = ${count} }\n`;
  const within = (name: string, low: number, high: number): string => {
    const half = (high - low) / state.c_size / 2; // the middles of the cells
    return axis(name, low + half, high - half, state.c_size);
  };
  const [periods, axes, varied] = state.view === "diagram"
    ? [state.d_periods, axis(state.d_x, state.d_from, state.d_to, state.d_count), [state.d_x]]
    : [state.c_periods, within(state.c_x, state.c_x0, state.c_x1) + within(state.c_y, state.c_y0, state.c_y1), [state.c_x, state.c_y]];
  const p = parameters(state);
  const lines = (names: readonly string[], of: Record<string, number>): string =>
    names.filter((name) => !varied.includes(name)).map((name) => `${name} = ${float(of[name] ?? 0)}\n`).join("");
  const compute = 'compute = ["itinerary", "progression"]\n';
  return `periods = ${periods}\n${compute}\n[parameters]\n${lines(PARAMETERS, p)}\n[start]\n${lines(ORIGIN, state as unknown as Record<string, number>)}\n[axes]\n${axes}`;
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
