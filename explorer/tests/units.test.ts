// The page's parts under Node, without a browser: what is computed, searched and coloured.
import assert from "node:assert/strict";
import { readFileSync } from "node:fs";
import { test } from "node:test";
import { inflateSync } from "node:zlib";
import { differenceCiede2000, filterDeficiencyDeuter, filterDeficiencyProt, filterDeficiencyTrit, rgb } from "culori";
import type { Color } from "culori";
import { Chart } from "../src/chart.ts";
import type { Giver } from "../src/chart.ts";
import { Core } from "../src/core.ts";
import type { Cell, Column, Parameters } from "../src/core.ts";
import { themeOf } from "../src/draw/colours.ts";
import { DEFAULTS } from "../src/fields.ts";
import type { Answer, CellsJob, MarkJob } from "../src/jobs.ts";
import { cyclicStart, eventName, meaning } from "../src/itinerary.ts";
import { MOST, marksBetween } from "../src/marks.ts";
import type { Runner } from "../src/marks.ts";
import { modulus, multipliers } from "../src/multipliers.ts";
import { Pool } from "../src/pool.ts";
import { SCENE } from "../src/scene.ts";
import { conflict, defaults, format, parse } from "../src/state.ts";
import type { State } from "../src/state.ts";

const page = readFileSync(process.env["PAGE"] ?? "", "utf8");
const packed = new RegExp(`id="library-${SCENE}">(eN[^<]+)<`).exec(page)?.[1] ?? "";
const library = Core.load(new WebAssembly.Module(inflateSync(Buffer.from(packed, "base64"))));
const study: Parameters = { ...DEFAULTS };

// Fields of an itinerary, by the paper's words and order.

test("fields are named, and a cycle begins in contact and at rest first", () => {
  assert.equal(meaning(3), "no contact, the capsule drifts backward");
  assert.equal(meaning(5), "contact, the capsule sticks");
  assert.equal(meaning(1), "no contact, the capsule drifts forward");
  const order = [5, 4, 6, 2, 1, 3];
  for (const [i, one] of order.entries())
    for (const other of order.slice(i + 1)) assert.deepEqual([cyclicStart([one, other]), cyclicStart([other, one])], [0, 1]);
});

test("an event is named by the fields about it", () => {
  const name = (before: number, during: number, after: number, force: number, v_r: number): string => eventName(before, during, after, force, v_r, study);
  assert.equal(name(1, 2, 4, 1, 1), "boundary-intersection crossing on O1");
  assert.equal(name(2, 2, 5, 0.5, 1), "boundary-intersection crossing on L6");
  assert.equal(name(4, 4, 3, -2, -1), "boundary-intersection crossing on L8");
  assert.equal(name(1, 4, 1, 2, 0), "grazing on L9");
  assert.equal(name(1, 2, 1, 1, 1), "grazing-sliding on L1");
  assert.equal(name(5, 4, 5, 1, 1), "adding-sliding on L3");
  assert.equal(name(4, 5, 6, -1, 1), "crossing-sliding on L4");
  assert.equal(name(3, 1, 2, 1, 1), "switching-sliding on L1");
  assert.equal(name(1, 1, 3, -1, 1), "change from forward to backward on L2");
});

// Runs that stand for the library's: an itinerary for every value of the parameter, or none in time.

const column = (fields: number[], stop: Column["stop"] = "done"): Column => ({
  stop, periodNumber: fields.length ? 1 : 0, progression: 0, work: 0, stick: 0, contact: 0, states: [], impacts: [], fields, matrix: null, end: [0, 0, 0],
});

function runner(itineraryAt: (alpha: number) => number[] | null): Runner {
  let alpha = NaN;
  const nothing = (): never => { throw new Error("not asked for"); };
  return {
    prepare: (p: Parameters) => { alpha = p.alpha; },
    start: () => undefined,
    column: () => { const itinerary = itineraryAt(alpha); return column(itinerary ?? [], itinerary ? "done" : "stopped"); },
    settle: () => "stopped", // no orbit is closed
    steady: nothing, record: nothing, closed: nothing, follow: nothing, along: nothing,
    orbitStart: nothing, orbitWithin: nothing, durations: nothing, bifurcation: nothing, segments: nothing,
  } as unknown as Runner;
}

const search: MarkJob = { kind: "mark", base: study, x: "alpha", from: 0, to: 1, start: [0, 0, 0], periods: 10 };

test("nothing is marked where a run was not finished, and what was found before counts", () => {
  const never = marksBetween(runner((alpha) => (alpha === 0 ? [2] : null)), search);
  assert.deepEqual(never.map(({ name, exact, value, doubt }) => [name, exact, value, doubt]), [["left open: a run was not finished", false, 0.5, 0.5]]);
  const later = marksBetween(runner((alpha) => (alpha < 0.125 ? [2] : alpha < 0.7 || alpha === 1 ? [5, 2] : null)), { ...search, to: 0.75, from: 0 });
  assert.ok(later.every(({ exact }) => !exact));
  assert.match(later.at(-1)?.name ?? "", /^left open/);
});

test("an interval with more events than are looked for says so", () => {
  const many = marksBetween(runner((alpha) => [2, ...new Array<number>(Math.floor(alpha * 64)).fill(5)]), search);
  assert.equal(many.length, MOST + 1);
  assert.match(many.at(-1)?.name ?? "", /more than 24 events/);
  const last = many.at(-1);
  assert.ok(last && Math.abs(last.value + last.doubt - 1) < 1e-12);
});

test("between two motions, what is only a long way from one to the other is no event", () => {
  // Not periodic in the time that a column takes, but the second motion in the end.
  let [alpha, runs] = [NaN, 0];
  const slow = runner(() => null);
  slow.prepare = (p) => { alpha = p.alpha; };
  slow.column = (periods) => {
    runs = Math.max(runs, periods);
    return column(alpha < 0.4 ? [2] : alpha > 0.41 || periods > 100 ? [5, 2] : []);
  };
  const marks = marksBetween(slow, search);
  assert.equal(marks.length, 1);
  assert.deepEqual([marks[0]?.before, marks[0]?.after, marks[0]?.name], ["2", "52", "jump to another motion"]);
  assert.ok(Math.abs((marks[0]?.value ?? 0) - 0.4) < 1e-8);
});

test("a motion that never leaves its field is measured where it can be, and not elsewhere", async () => {
  const core = await library;
  core.prepare({ ...study, alpha: 0.001 });
  core.start([0, 0, 0]);
  const found = core.column(100);
  assert.deepEqual([found.progression, found.stick, found.contact, found.fields], [0, 1, 0, [2]]);
  assert.ok(Number.isNaN(found.work));
  core.start([0, 0, 0]);
  const cell = core.cell(100);
  assert.deepEqual([cell.fields, cell.progression, cell.periodNumber], [[2], 0, 1]);
});

test("no itinerary is cut", async () => {
  const core = await library;
  core.prepare({ ...study, alpha: 1.16, omega: 0.008, zeta: 0.001, ...{ delta: 0, beta: 30 } });
  core.start([0, 0, 0]);
  assert.equal(core.column(10).fields.length, 290); // by simulate(...).steady().word
  core.start([0, 0, 0]);
  assert.equal(core.cell(10).fields.length, 290);
});

test("a column has the multipliers of its orbit", async () => {
  const core = await library;
  core.prepare(study);
  core.start([0, 0, 0]);
  const { matrix } = core.column(100);
  const [largest, next, none] = multipliers(matrix ?? []).map(modulus);
  assert.ok(Math.abs((largest ?? 0) - 0.5364) < 1e-4); // by orbits.stability.multipliers
  assert.ok(Math.abs((next ?? 0) - 0.5364) < 1e-4);
  assert.equal(none, 0);
});

// Charts of cells that are known: what is not run must be what a run would have given.

type Known = (x: number, y: number) => Partial<Cell>;

function charted(known: Known, change: Partial<State>): { chart: Chart; runs: number } {
  let runs = 0;
  const queue: (() => void)[] = [];
  const giver: Giver = {
    cancel: () => undefined,
    give: (ask, listener) => {
      const job = queue.length + 1;
      queue.push(() => {
        const { places } = ask as CellsJob;
        runs += places.length;
        const cells = places.map(([x, y]): Cell => ({ stop: "done", periodNumber: 1, progression: 0, fields: [2], mean: [0, 0, 0], ...known(x, y) }));
        listener({ job, cells } as Answer);
        listener({ job, done: true });
      });
      return job;
    },
  };
  const chart = new Chart(giver, () => undefined);
  chart.run({ ...defaults(), view: "chart", c_size: 128, ...change });
  for (let k = 0; k < queue.length; k++) queue[k]?.();
  return { chart, runs };
}

test("progressions between cells that were run are interpolated", () => {
  const plane = (x: number, y: number): number => 0.3 * x - 0.2 * y;
  const { chart, runs } = charted((x, y) => ({ progression: plane(x, y) }), {});
  assert.ok(runs < 1000);
  chart.progressions.forEach((value, k) => {
    const [x, y] = chart.place(k % 128, Math.floor(k / 128));
    assert.ok(Math.abs(value - plane(x, y)) < 1e-12);
  });
});

test("where the progression is steep it is run", () => {
  const jump = (x: number): number => (x < 1.03 ? -2 : 2);
  const { chart } = charted((x) => ({ progression: jump(x) }), {});
  chart.progressions.forEach((value, k) => assert.equal(value, jump(chart.place(k % 128, 0)[0])));
});

test("a region is whole wherever its border is met", () => {
  // A thin arm between the nodes of the coarse grid, from a region that they do see.
  const inside = (x: number, y: number): boolean => x < 0.5 || (x < 1.7 && Math.abs(y - 2.1 - 0.1 * x) < 0.04);
  const { chart, runs } = charted((x, y) => ({ fields: inside(x, y) ? [5, 2] : [2] }), {});
  assert.ok(runs < 0.3 * 128 * 128);
  chart.of.forEach((region, k) => {
    const [x, y] = chart.place(k % 128, Math.floor(k / 128));
    assert.equal(chart.regions[region]?.itinerary, inside(x, y) ? "52" : "2");
  });
});

test("the colours follow the areas, whatever is found first", () => {
  // The first corner is in the smallest region.
  const itinerary = (x: number, y: number): number[] => (x < 0.3 && y < 1.6 ? [2] : x < 0.8 ? [5, 2] : [5, 4, 1, 2]);
  const { chart } = charted((x, y) => ({ fields: itinerary(x, y) }), {});
  assert.deepEqual(chart.regions.map(({ itinerary }) => itinerary), ["2", "52", "5412"]);
  assert.deepEqual(chart.regions.map((_, region) => chart.rank(region)), [2, 1, 0]);
});

test("what is left open is shown as open, and never taken from its neighbours", () => {
  const open = (x: number, y: number): boolean => Math.hypot(x - 1.2, y - 3) < 0.5;
  const { chart } = charted((x, y) => (open(x, y) ? { stop: "open", periodNumber: 0, fields: [] } : {}), {});
  chart.of.forEach((region, k) => {
    const [x, y] = chart.place(k % 128, Math.floor(k / 128));
    assert.equal(region === -3, open(x, y));
    assert.equal(Number.isNaN(chart.progressions[k]), open(x, y));
  });
});

test("attractors are told apart over starts, and only there", () => {
  const starts = { c_x: "x_r", c_y: "v_r", c_x0: -1, c_x1: 1, c_y0: -1, c_y1: 1 };
  const twins: Known = (x) => ({ mean: x < 0 ? [0.3, 0, 0] : [-0.3, 0, 0], progression: 0 });
  assert.equal(charted(twins, { ...starts, c_by: "attractor" }).chart.regions.length, 2);
  assert.equal(charted(twins, { ...starts, c_by: "itinerary" }).chart.regions.length, 1);
  // Rounding of a motion that settled is no other motion, wherever the digits change.
  const rounded: Known = (x) => ({ mean: [0.1234565 + (x < 0 ? 1e-9 : -1e-9), 0, 0], progression: 0.4999995 + (x < 0 ? 1e-9 : -1e-9) });
  assert.equal(charted(rounded, { ...starts, c_by: "attractor" }).chart.regions.length, 1);
  assert.match(conflict({ ...defaults(), c_by: "attractor" }), /over two starts/);
  assert.match(parse("#c_by=attractor&c_x=x_r").refused, /over two starts/);
  assert.equal(conflict({ ...defaults(), ...starts, c_by: "attractor" }), "");
});

test("the address holds plane, turn and phase, and gives them back", () => {
  const state = { ...defaults(), plane: "v_r-v_c", around: 120, above: -30, phase: 0.1 + 0.2, c_x: "phase", c_x0: 0, c_x1: 7 };
  assert.deepEqual(parse(`#${format(state)}`), { state, refused: "" });
});

test("a worker that dies ends its jobs, and the page is told", async () => {
  class Dead {
    onmessage = null;
    onerror: ((event: unknown) => void) | null = null;
    onmessageerror = null;
    terminate(): void {}
    postMessage(ask: object): void {
      if ("ask" in ask) queueMicrotask(() => this.onerror?.({ message: "no memory", preventDefault: () => undefined }));
    }
  }
  Object.assign(globalThis, { Worker: Dead });
  const heard: string[] = [];
  const pool = new Pool("", new WebAssembly.Module(inflateSync(Buffer.from(packed, "base64"))), (why) => heard.push(why), 1);
  const ask: CellsJob = { kind: "cells", base: study, start: { state: [0, 0, 0], phase: 0 }, x: "alpha", y: "gamma", places: [], periods: 1 };
  const ended = (): Promise<void> => new Promise((go) => pool.give(ask, (answer) => "done" in answer && go()));
  await ended();
  assert.deepEqual(heard, ["no memory"]);
  await ended(); // no worker is left: it ends as well
});

// Colours under the three deficiencies, by CIEDE2000: 10 is seen at a glance.

const EYES = [(colour: Color) => colour, filterDeficiencyProt(1), filterDeficiencyDeuter(1), filterDeficiencyTrit(1)];
const difference = differenceCiede2000();

function nearest(colours: readonly string[]): [number, string, string] {
  let least: [number, string, string] = [Infinity, "", ""];
  const seen = (colour: string): Color => rgb(colour) ?? assert.fail(`${colour} is no colour`);
  for (const eye of EYES)
    colours.forEach((one, i) =>
      colours.slice(i + 1).forEach((other) => {
        const away = difference(eye(seen(one)), eye(seen(other)));
        if (away < least[0]) least = [away, one, other];
      }),
    );
  return least;
}

for (const dark of [false, true]) {
  const theme = themeOf(dark);
  const name = dark ? "dark" : "light";
  for (const [what, colours, least] of [
    ["fields", theme.fields, 10],
    ["ways of a diagram and its bifurcations", [theme.accent, theme.fields[5] ?? "", theme.soft, theme.mark, theme.paper], 10],
    ["curves of a history", [theme.ink, theme.accent, theme.mark], 10],
    ["regions", theme.itineraries, 10],
  ] as const)
    test(`${what} are told apart by all eyes, ${name}`, () => {
      const [away, one, other] = nearest(colours);
      assert.ok(away >= least, `${one} and ${other}: ${away.toFixed(1)}`);
    });
}

test("the check of colours fails for colours that some eyes confuse", () => {
  assert.ok(nearest(["#d55e00", "#7a7a00"])[0] < 10);
});
