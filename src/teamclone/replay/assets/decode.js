// The data of the page: base64, deflate, whole numbers. The format is described in payload.py.

/** Return {head, columns}; a column is {data, rows, step, none}, its numbers row by row. */
export async function decode(base64) {
  const packed = Uint8Array.fromBase64?.(base64) ?? Uint8Array.from(atob(base64), (one) => one.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  const length = new DataView(bytes.buffer).getUint32(0, true);
  const head = JSON.parse(new TextDecoder().decode(bytes.subarray(4, 4 + length)));
  const columns = new Map();
  let at = 4 + length;
  for (const column of head.columns) {
    const count = column.rows * head.frames;
    columns.set(column.name, numbers(bytes.subarray(at, at + count * column.bytes), column, head.frames));
    at += count * column.bytes;
  }
  return { head, columns };
}

const ARRAYS = { 1: Int8Array, 2: Int16Array, 4: Int32Array };

function numbers(bytes, column, frames) {
  const count = column.rows * frames;
  const data = new ARRAYS[column.bytes](count);
  for (let place = 0; place < column.bytes; place++) {
    const plane = bytes.subarray(place * count, (place + 1) * count);
    for (let i = 0; i < count; i++) data[i] |= plane[i] << (8 * place);
  }
  const mask = column.bytes === 4 ? -1 : (1 << (8 * column.bytes)) - 1; // of what is unsigned for now
  for (let i = 0; i < count; i++) {
    const folded = data[i] & mask;
    data[i] = (folded >>> 1) ^ -(folded & 1);
  }
  // Typed arrays wrap by themselves, so sums undo differences modulo the range.
  for (let order = 0; order < column.order; order++)
    for (let row = 0; row < column.rows; row++)
      for (let i = row * frames + 1; i < (row + 1) * frames; i++) data[i] += data[i - 1];
  const none = -(2 ** (8 * column.bytes - 1));
  return { data, rows: column.rows, step: column.step, none };
}
