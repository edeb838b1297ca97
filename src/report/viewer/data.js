// Numbers of the page: planes of bytes, compressed by zlib, in base64. Integers are differences to the number before.

let texts = null;
const decoded = new Map();

async function planesOf(index) {
  texts ??= JSON.parse(document.getElementById("arrays").textContent);
  const raw = Uint8Array.from(atob(texts[index]), (c) => c.charCodeAt(0));
  const stream = new DecompressionStream("deflate");
  const writer = stream.writable.getWriter();
  // An error of the writer is one of the reader as well.
  writer.write(raw).catch(() => {});
  writer.close().catch(() => {});
  return new Uint8Array(await new Response(stream.readable).arrayBuffer());
}

function wholeNumbers(planes, count, differences, mask) {
  const out = new Uint32Array(count);
  const width = count ? planes.length / count : 0;
  let last = 0;
  for (let k = 0; k < count; k++) {
    let value = 0;
    for (let p = 0; p < width; p++) value |= planes[p * count + k] << (8 * p);
    last = differences ? (last + value) & mask : value;
    out[k] = last;
  }
  return out;
}

async function decode(what) {
  const planes = await planesOf(what.array);
  if (what.kind === "f32") {
    const bits = wholeNumbers(planes, what.count, false, -1);
    return new Float32Array(bits.buffer);
  }
  if (what.kind === "u32") return wholeNumbers(planes, what.count, true, -1);
  const codes = wholeNumbers(planes, what.count, true, 0xffff);
  return Float32Array.from(codes, (code) => (code === 0xffff ? NaN : what.low + what.step * code));
}

// A typed array; arrays are decoded once.
function numbers(what) {
  const key = JSON.stringify(what);
  if (!decoded.has(key)) decoded.set(key, decode(what));
  return decoded.get(key);
}

// Places: x, y, z of each point.
async function places(axes) {
  const [x, y, z] = await Promise.all(axes.map(numbers));
  const out = new Float32Array(3 * x.length);
  [x, y, z].forEach((axis, c) => axis.forEach((value, k) => (out[3 * k + c] = value)));
  return out;
}

// A number with five significant digits, four where it has an exponent.
function digits(value) {
  if (!Number.isFinite(value)) return "no value";
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-4 || size >= 1e6)) return value.toExponential(3);
  return String(Number(value.toPrecision(5)));
}

// Decimals of places that are known this well [mm].
function decimals(accuracy) {
  return Math.max(0, Math.min(3, Math.floor(-Math.log10(2 * Math.max(accuracy, 1e-9)))));
}
