// The page's library under Node: systems of a scene from stdin, the records it makes of them on stdout, both as JSON.
import { readFileSync } from "node:fs";
import { inflateSync } from "node:zlib";

const { scene, sizes, systems } = JSON.parse(readFileSync(0, "utf8"));
const page = readFileSync(process.argv[2], "utf8");
const [, packed] = page.match(new RegExp(`id="library-${scene}">(eN[^<]+)<`));
const code = inflateSync(Buffer.from(packed, "base64"));
const { instance } = await WebAssembly.instantiate(code, { page: { late: () => 0 } });
const c = instance.exports;
c._initialize();
const given = new Float64Array(c.memory.buffer, c.given_at(), systems[0].parameters.length);

/** The bytes of a record, or of some, as text. */
const bytes = (at, size) => Buffer.from(c.memory.buffer, at, size).toString("base64");

const out = systems.map(({ parameters, state, phase, periods }) => {
  given.set(parameters);
  c.prepare();
  c.start(...state, phase);
  const stop = c.record(periods);
  const segments = bytes(c.segments_at(), c.recorded() * sizes.segment);
  return { stop, segments, state: bytes(c.state_at(), sizes.state) };
});
process.stdout.write(JSON.stringify(out));
