// One scene's page under Node: its address, its names of events, its colours. SCENE names the scene.
import assert from "node:assert/strict";
import { test } from "node:test";
import { fieldColour, themeOf } from "../src/draw/colours.ts";
import { CHOICES, DEFAULTS, RANGES } from "../src/fields.ts";
import { cyclicStart, digits, doubled, edgeOf, eventName, meaning, numbers, spelled } from "../src/itinerary.ts";
import { MODEL, MODES, PARAMETERS, SCENE, SCENES, bound, driveAt, edges, dragged, sceneOf, stops } from "../src/scene.ts";
import { conflict, defaults, format, parse } from "../src/state.ts";
import { asCommand, asFile, asPython } from "../src/ui/share.ts";
import { fromFile } from "../src/ui/files.ts";

const asked = process.env["SCENE"] ?? "";
const fields = MODES.map((_, i) => i + 1);
const half = MODES.length / ((MODEL.SPRINGS.length + 1) * 3);

test("the scene is the one that is asked for, and its defaults are allowed", () => {
  assert.equal(SCENE, asked);
  assert.deepEqual(SCENES, CHOICES.scene.of);
  assert.equal(sceneOf("#view=chart&scene=nothing"), SCENES[0]);
  for (const view of CHOICES.view.of) assert.equal(conflict({ ...defaults(), view, units: "device" }), "");
  for (const name of PARAMETERS) assert.ok(RANGES[name][0] < RANGES[name][1]);
});

test("the address holds the scene, and gives it back", () => {
  const state = { ...defaults(), omega: 0.55, view: "diagram" };
  assert.deepEqual(parse(`#${format(state)}`), { state, refused: "" });
  assert.equal(format(defaults()), SCENE === SCENES[0] ? "" : `scene=${SCENE}`);
  assert.match(parse("#scene=nothing").refused, /scene=nothing: must be one of capsule, slope/);
});

test("stops that overlap are refused", () => {
  const closed = MODEL.SPRINGS.map(([gap]) => `${gap}=0`).join("&");
  assert.equal(parse(`#scene=${SCENE}&${closed}`).refused.includes("the stops overlap"), MODEL.SPRINGS.length > 1);
});

test("a file of the scene is taken, and one of another scene is not", () => {
  const state = defaults();
  assert.deepEqual({ ...state, ...(fromFile(asFile(state)) as object) }, state);
  const other = SCENES.find((name) => name !== SCENE);
  assert.match(String(fromFile(`scene = "${other}"`)), /choose that first/);
  assert.equal(asCommand(state).includes("--scene"), SCENE !== SCENES[0]);
  assert.equal(asPython(state, true).includes(`scenes.${SCENE}.Parameters()`), SCENE !== SCENES[0]);
});

test("itineraries are written, read and begun in contact", () => {
  assert.deepEqual(numbers(digits(fields)).map(Number).sort((a, b) => a - b), fields);
  assert.equal(numbers("").length, 0);
  assert.equal(spelled(digits([2, 1])), "F2 F1");
  assert.ok(doubled(digits([2, 1, 2, 1]), digits([2, 1])) && !doubled(digits([2, 1]), digits([2, 1])));
  assert.equal(new Set(fields.map(meaning)).size, fields.length);
  const order = [...fields].sort((one, other) => (cyclicStart([one, other]) ? 1 : -1));
  assert.deepEqual(order.slice(0, 2).map((field) => MODEL.FIELDS[field]?.contact), [1, 1]);
});

test("an event has the line of its stop, and that of an edge none", () => {
  const p = { ...DEFAULTS };
  const [high, low] = [bound(p, 1), -bound(p, -1)];
  const last = MODEL.SPRINGS.length === 1;
  assert.equal(eventName(2, 1, 2, high, 1, p), "adding-sliding on L1");
  assert.equal(eventName(5, 6, 5, low, 1, p), "adding-sliding on L4");
  if (!last) assert.equal(eventName(8, 9, 8, low, 1, p), "adding-sliding on L6");
  // Lines follow rest's edges, two a contact; of each stop six, seven where the drive reacts.
  const [rest, each] = [2 * (MODEL.SPRINGS.length + 1), MODEL.REACTS ? 7 : 6];
  stops(p).forEach(({ side }, k) => {
    const touching = 4 + 3 * k;
    assert.equal(eventName(1, touching, 1, 2 * high, 0, p), `grazing on L${rest + each * k + 5}`);
    assert.equal(eventName(2, 2, touching + 1, 0, side, p), `boundary-intersection crossing on L${rest + each * k + 2}`);
    assert.equal(eventName(2, 2, touching + 1, side > 0 ? high : low, side, p), `boundary-intersection crossing on O${1 + 3 * k}`);
  });
  for (const field of fields.slice(0, fields.length / half)) {
    assert.equal(edgeOf(field, field), "");
    if (half === 1) continue;
    const lower = field + fields.length / 2;
    assert.equal(eventName(field, lower, lower, 0, 1, p), "edge: a switch at the fall of the drive");
    assert.equal(eventName(lower, lower, field, 0, 1, p), "edge: a switch at the rise of the drive");
  }
});

test("the drive is high until its fall", () => {
  const [rise, fall = NaN] = edges(DEFAULTS);
  assert.equal(rise === undefined, half === 1);
  assert.equal(driveAt(DEFAULTS, 0), DEFAULTS.alpha);
  if (rise === undefined) return;
  assert.equal(driveAt(DEFAULTS, fall - 1e-9), DEFAULTS.alpha);
  assert.notEqual(driveAt(DEFAULTS, fall), DEFAULTS.alpha);
});

test("a mean force beyond friction drags the device", () => {
  const p = { ...DEFAULTS };
  assert.equal(dragged(p), 0);
  const { LOAD, PULSES, REACTS } = MODEL;
  if (LOAD) assert.deepEqual([dragged({ ...p, [LOAD]: -2 }), dragged({ ...p, [LOAD]: 2 })], [1, -1]);
  const [high, , share] = PULSES;
  if (!high || !share) return;
  const beyond = bound(p, 1) / p[high] + 1e-3;
  if (beyond < 1) assert.deepEqual([dragged({ ...p, [share]: beyond }), dragged({ ...p, [share]: beyond - 2e-3 })], REACTS ? [0, 0] : [1, 0]);
});

for (const dark of [false, true])
  test(`each field has a colour of its own, ${dark ? "dark" : "light"}`, () => {
    const theme = themeOf(dark);
    assert.equal(new Set(fields.map((field) => fieldColour(field, theme))).size, fields.length);
  });
