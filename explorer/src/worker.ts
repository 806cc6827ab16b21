// A worker: takes jobs one after another, and looks between their pieces whether they are still wanted.
import { Core } from "./core.ts";
import type { Axis } from "./fields.ts";
import { PARAMETERS } from "./fields.ts";
import type { Answer, Ask, CellsJob, Job, Start, SweepJob } from "./jobs.ts";
import { marksBetween } from "./marks.ts";
import type { Parameters, Triple } from "./core.ts";

const PIECE = 40; // milliseconds between two looks
const PATIENCE = 3000; // milliseconds for one run
const SEARCH = 10_000; // for all runs of a search between two columns

let core: Core | undefined;
const wanted: { job: number; ask: Job }[] = [];
const cancelled = new Set<number>();
let busy = false;

const say = (answer: Answer): void => postMessage(answer);
const breath = new MessageChannel();
const waiting: (() => void)[] = [];
breath.port1.onmessage = () => waiting.shift()?.();

/** Lets messages in. */
const pause = (): Promise<void> =>
  new Promise((go) => {
    waiting.push(go);
    breath.port2.postMessage(0);
  });

onmessage = ({ data }: MessageEvent<Ask>): void => {
  if ("code" in data) {
    void Core.load(data.code).then((made) => {
      core = made;
      say({ ready: true });
      void work();
    });
  } else if ("cancel" in data) {
    cancelled.add(data.cancel);
  } else {
    wanted.push(data);
    void work();
  }
};

async function work(): Promise<void> {
  if (busy || !core) return;
  busy = true;
  for (let next = wanted.shift(); next; next = wanted.shift()) {
    const { job, ask } = next;
    try {
      if (!cancelled.has(job)) await act(core, job, ask);
      say({ job, done: true });
    } catch (error) {
      say({ job, failed: String(error) });
    }
    await pause();
  }
  busy = false;
}

async function act(core: Core, job: number, ask: Job): Promise<void> {
  if (ask.kind === "sweep") await sweep(core, job, ask);
  else if (ask.kind === "cells") await cells(core, job, ask);
  else {
    core.limit(SEARCH);
    say({ job, marks: marksBetween(core, ask) });
  }
}

/** Starts a run; a time beyond the excitation period stands for the same phase within it. */
function begin(core: Core, p: Parameters, start: Start): void {
  core.prepare(p);
  core.start(start.state, start.phase % ((2 * Math.PI) / p.omega));
}

async function sweep(core: Core, job: number, ask: SweepJob): Promise<void> {
  let { start } = ask;
  for (let i = 0; i < ask.values.length; ) {
    const until = performance.now() + PIECE;
    const from = i;
    const columns = [];
    do {
      core.limit(PATIENCE);
      begin(core, { ...ask.base, [ask.x]: ask.values[i] ?? 0 }, start);
      const column = core.column(ask.periods);
      if (ask.onward && column.stop === "done") start = { state: column.end, phase: 0 };
      columns.push(column);
      i++;
    } while (i < ask.values.length && performance.now() < until);
    say({ job, part: { from, columns } });
    await pause();
    if (cancelled.has(job)) return;
  }
}

async function cells(core: Core, job: number, ask: CellsJob): Promise<void> {
  const done = [];
  let until = performance.now() + PIECE;
  for (const place of ask.places) {
    core.limit(PATIENCE);
    begin(core, ...at(ask, place));
    done.push(core.cell(ask.periods));
    if (performance.now() < until) continue;
    await pause();
    if (cancelled.has(job)) return;
    until = performance.now() + PIECE;
  }
  say({ job, cells: done });
}

function at(ask: CellsJob, place: readonly [number, number]): [Parameters, Start] {
  const p = { ...ask.base };
  const state: [number, number, number] = [...ask.start.state];
  let { phase } = ask.start;
  const put = (axis: Axis, value: number): void => {
    const k = (["x_r", "v_r", "v_c"] as const).findIndex((name) => name === axis);
    const name = PARAMETERS.find((one) => one === axis);
    if (name) p[name] = value;
    else if (axis === "phase") phase = value;
    else state[k] = value as Triple[number];
  };
  put(ask.x, place[0]);
  put(ask.y, place[1]);
  return [p, { state, phase }];
}
