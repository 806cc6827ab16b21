// The page's library under Node: systems from stdin, what it makes of them on stdout, both as JSON.
import { readFileSync } from "node:fs";
import { inflateSync } from "node:zlib";

const page = readFileSync(process.argv[2], "utf8");
const [packed] = page.match(/eN[A-Za-z0-9+/=]{20000,}/);
const code = inflateSync(Buffer.from(packed, "base64"));
const { instance } = await WebAssembly.instantiate(code, { page: { late: () => 0 } });
const c = instance.exports;
c._initialize();
const numbers = new Float64Array(c.memory.buffer, c.numbers_at(), 1 << 17);
const given = new Float64Array(c.memory.buffer, c.given_at(), 7);

const SEGMENT = 21;
const out = JSON.parse(readFileSync(0, "utf8")).map(({ parameters, state, phase, periods }) => {
  given.set(parameters);
  c.prepare();
  c.start(...state, phase);
  const stop = c.record(periods);
  const count = c.segments();
  const itinerary = Array.from({ length: count }, (_, i) => [...numbers.slice(i * SEGMENT, i * SEGMENT + 3)]);
  c.where();
  const [x_r, v_r, v_c, , position] = numbers;
  return { stop, itinerary, final: [x_r, v_r, v_c], position };
});
process.stdout.write(JSON.stringify(out));
