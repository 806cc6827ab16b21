// Exports: the state as Python, as a command line, as a device's file; a motion as CSV.
import { withUnit } from "../device.ts";
import type { Unit } from "../device.ts";
import { DEVICE, ORIGIN, PARAMETERS } from "../fields.ts";
import { OUTCOMES, SCENE, SCENES } from "../scene.ts";
import { POINT } from "../core.ts";
import type { Motion } from "../motion.ts";
import { defaults, parameters, startOf } from "../state.ts";
import type { State } from "../state.ts";

const plain = defaults();
// The first scene is what the package takes for granted.
const ours = SCENE !== SCENES[0];
const table = ours ? `scene = "${SCENE}"\n` : "";
const SETTLED = 1024; // periods in which solve_orbit looks by default
/** The start without units: the state, empty where it is 0, and the phase. */
function started(state: State): { from: number[]; phase: number } {
  const { x_r, v_r, v_c, phase } = startOf(state);
  return { from: x_r || v_r || v_c ? [x_r, v_r, v_c] : [], phase };
}
const float = (value: number): string => {
  const text = String(value);
  return /[.e]/.test(text) ? text : `${text}.0`;
};

/** Code that gives what is shown: the periodic motion, or the end of a run that came to none. */
export function asPython(state: State, periodic: boolean): string {
  if (state.view !== "motion")
    return `import tomllib\n\nfrom capsule_sym import inputs, results, run_sweep\n\nplan = tomllib.loads('''\n${asFile(state)}''')\nrun_sweep(inputs.read_plan(plan), "sweep")\ncells = results.open_results("sweep")\nprint(cells)\n`;
  const p = parameters(state);
  const device = state.units === "device";
  const given = device
    ? DEVICE.map((name) => `${name}=${float(state[name])}`)
    : PARAMETERS.filter((name) => p[name] !== plain[name]).map((name) => `${name}=${float(p[name])}`);
  const { from, phase } = started(state);
  const periods = periodic && state.periods <= SETTLED ? [] : [`periods=${state.periods}`];
  const name = device ? "PhysicalParameters" : "Parameters";
  const made = `${ours ? `scenes.${SCENE}.` : ""}${name}(${given.join(", ")})${device ? ".dimensionless()" : ""}`;
  const imported = ours ? "scenes" : name;
  const all = [made, ...(from.length ? [`state=(${from.map(float).join(", ")})`] : []), ...(phase ? [`phase=${float(phase)}`] : []), ...periods].join(", ");
  return periodic
    ? `from capsule_sym import ${imported}, solve_orbit\n\norbit = solve_orbit(${all})\nprint(orbit.motion.global_map, orbit.progression)\n`
    : `from capsule_sym import ${imported}, simulate\n\ntrajectory = simulate(${all})\nprint(trajectory.final)\n`;
}

export function asCommand(state: State): string {
  if (state.view !== "motion") return `capsule-sym sweep sweep.toml --out sweep${state.view === "chart" ? " --refine 16" : ""}\n`;
  const p = parameters(state);
  const flags = state.units === "device"
    ? ["--params device.toml"]
    : [...(ours ? [`--scene ${SCENE}`] : []), ...PARAMETERS.filter((name) => p[name] !== plain[name]).map((name) => `--${name.replaceAll("_", "-")} ${p[name]}`)];
  const { from, phase } = started(state);
  if (from.length) flags.push(`--state ${from.join(" ")}`);
  if (phase) flags.push(`--phase ${phase}`);
  flags.push(`--periods ${state.periods}`);
  return `capsule-sym run ${flags.join(" ")}\n`;
}

/** Description of the file. */
export const fileTitle = (state: State): string =>
  state.view !== "motion" ? "File of the sweep, sweep.toml: every value run from the start"
  : state.units === "device" ? "File of the device, device.toml" : "File of the parameters, for --params";

/** A TOML file for --params: the device in SI units, or the dimensionless parameters. Of a view of many motions that for a sweep. */
export function asFile(state: State): string {
  if (state.view !== "motion") return sweepFile(state);
  const names = state.units === "device" ? DEVICE : PARAMETERS;
  return table + names.map((name) => `${name} = ${float(state[name])}\n`).join("");
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
  return `${table}periods = ${periods}\n${compute}\n[parameters]\n${lines(PARAMETERS, p)}\n[start]\n${lines(ORIGIN, startOf(state))}\n[axes]\n${axes}`;
}

type Columns = readonly (readonly [name: string, unit: Unit])[];
const headed = (columns: Columns): string[] => columns.map(([name, unit]) => withUnit(name, unit));
const scaled = (values: readonly number[], columns: Columns): number[] => columns.map(([, unit], k) => (values[k] ?? NaN) * unit.factor);

export function pointsCsv(motion: Motion): string {
  const { time, length, velocity } = motion.units;
  const columns: Columns = [["time", time], ["x_r", length], ["v_r", velocity], ["v_c", velocity], ["x_c", length]];
  const rows = [["segment", "field", ...headed(columns)].join(",")];
  for (let i = 0; i < motion.points.length; i += POINT) {
    const [segment = 0, ...values] = motion.points.subarray(i, i + POINT - 1);
    rows.push([segment, motion.segments[segment]?.field, ...scaled(values, columns)].join(","));
  }
  return `${rows.join("\n")}\n`;
}

export function segmentsCsv(motion: Motion): string {
  const { time, length, velocity } = motion.units;
  const state = (at: string): Columns => [[`${at}_x_r`, length], [`${at}_v_r`, velocity], [`${at}_v_c`, velocity]];
  const columns: Columns = [["duration", time], ...state("start"), ...state("end")];
  const rows = [["field", "source", "target", "outcome", ...headed(columns), "decided_in_106_bits"].join(",")];
  for (const s of motion.cycle)
    rows.push([`F${s.field}`, `Σ${s.source}`, `Σ${s.target}`, OUTCOMES[s.outcome], ...scaled([s.duration, ...s.start, ...s.end], columns), s.wide !== 0].join(","));
  return `${rows.join("\n")}\n`;
}
