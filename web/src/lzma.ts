/** The core is packed by LZMA, a third smaller than by the gzip that browsers undo themselves. Format: LZMA SDK, `lzma-specification.txt`. */

/** Bytes from two letters for 13 or 14 bits each, as `packing.py` writes them; perhaps one byte 0 more. */
export function fromText(text: string): Uint8Array {
  const bytes = new Uint8Array(text.length);
  // 93 letters from "!" on, without "<".
  const digit = (at: number) => (at < text.length ? text.charCodeAt(at) - (text.charCodeAt(at) > 60 ? 34 : 33) : 0);
  let [bits, count, done] = [0, 0, 0];
  for (let i = 0; i < text.length; i += 2) {
    const number = digit(i) + 93 * digit(i + 1);
    bits |= number << count;
    for (count += (number & 8191) < 93 * 93 - 8192 ? 14 : 13; count > 7; count -= 8) {
      bytes[done++] = bits & 255;
      bits >>>= 8;
    }
  }
  return bytes.subarray(0, done);
}

/** Tables of probabilities, each that a bit is 0, in parts of 2048. */
const fresh = (count: number) => new Uint16Array(count).fill(1024);

/** What a `.lzma` file with known length holds. */
export function unlzma(packed: Uint8Array): Uint8Array<ArrayBuffer> {
  const props = packed[0]!;
  const [lc, lp, pb] = [props % 9, ((props / 9) | 0) % 5, (props / 45) | 0];
  const head = new DataView(packed.buffer, packed.byteOffset);
  const out = new Uint8Array(head.getUint32(5, true));
  let at = 18;
  // Range and code: numbers of 32 bits, which variables would keep as objects.
  const now = Uint32Array.of(0xffffffff, head.getUint32(14));

  const more = () => {
    if (now[0]! >= 0x1000000) return;
    now[0]! <<= 8;
    now[1] = (now[1]! << 8) | packed[at++]!;
  };
  /** One bit under its probability, which learns from it. */
  const bit = (table: Uint16Array, index: number): number => {
    const p = table[index]!;
    const bound = (now[0]! >>> 11) * p;
    const one = now[1]! >= bound ? 1 : 0;
    now[0] = one ? now[0]! - bound : bound;
    if (one) now[1]! -= bound;
    table[index] = one ? p - (p >> 5) : p + ((2048 - p) >> 5);
    more();
    return one;
  };
  const tree = (table: Uint16Array, bits: number, from = 0): number => {
    let node = 1;
    for (let i = 0; i < bits; i++) node = 2 * node + bit(table, from + node);
    return node - (1 << bits);
  };
  /** The lowest bit first. */
  const reverse = (table: Uint16Array, bits: number, from: number): number => {
    let [node, value] = [1, 0];
    for (let i = 0; i < bits; i++) {
      const one = bit(table, from + node);
      node = 2 * node + one;
      value |= one << i;
    }
    return value;
  };
  const direct = (bits: number): number => {
    let value = 0;
    for (let i = 0; i < bits; i++) {
      now[0]! >>>= 1;
      const one = now[1]! >= now[0]! ? 1 : 0;
      if (one) now[1]! -= now[0]!;
      more();
      value = 2 * value + one;
    }
    return value;
  };
  const lengths = () => ({ choice: fresh(2), low: fresh(8 << 4), mid: fresh(8 << 4), high: fresh(256) });
  const length = ({ choice, low, mid, high }: ReturnType<typeof lengths>, place: number): number => {
    if (!bit(choice, 0)) return 2 + tree(low, 3, place << 3);
    if (!bit(choice, 1)) return 10 + tree(mid, 3, place << 3);
    return 18 + tree(high, 8);
  };

  const [literals, match, rep, rep0, rep0Long, rep1, rep2] = [0x300 << (lc + lp), 192, 12, 12, 192, 12, 12].map(fresh);
  const [slots, special, align] = [fresh(4 << 6), fresh(128), fresh(16)];
  const [matchLength, repLength] = [lengths(), lengths()];
  let [state, done] = [0, 0];
  let reps = [0, 0, 0, 0];
  while (done < out.length) {
    const place = done & ((1 << pb) - 1);
    if (!bit(match!, (state << 4) + place)) {
      const before = done && out[done - 1]!;
      const from = 0x300 * (((done & ((1 << lp) - 1)) << lc) + (before >> (8 - lc)));
      let node = 1;
      if (state >= 7)
        for (let twin = out[done - reps[0]! - 1]!; node < 0x100; twin <<= 1) {
          const expected = (twin >> 7) & 1;
          const one = bit(literals!, from + ((1 + expected) << 8) + node);
          node = 2 * node + one;
          if (one !== expected) break;
        }
      while (node < 0x100) node = 2 * node + bit(literals!, from + node);
      out[done++] = node;
      state = state < 4 ? 0 : state < 10 ? state - 3 : state - 6;
      continue;
    }
    let count: number;
    if (bit(rep!, state)) {
      const [a, b, c, d] = reps as [number, number, number, number];
      if (!bit(rep0!, state)) {
        if (!bit(rep0Long!, (state << 4) + place)) {
          state = state < 7 ? 9 : 11;
          out[done] = out[done - a - 1]!;
          done++;
          continue;
        }
      } else if (!bit(rep1!, state)) reps = [b, a, c, d];
      else reps = bit(rep2!, state) ? [d, a, b, c] : [c, a, b, d];
      count = length(repLength, place);
      state = state < 7 ? 8 : 11;
    } else {
      count = length(matchLength, place);
      state = state < 7 ? 7 : 10;
      const slot = tree(slots, 6, Math.min(count - 2, 3) << 6);
      let distance = slot;
      if (slot >= 4) {
        const bits = (slot >> 1) - 1;
        distance = (2 | (slot & 1)) << bits;
        if (slot < 14) distance += reverse(special, bits, distance - slot);
        else distance += (direct(bits - 4) << 4) + reverse(align, 4, 0);
      }
      reps = [distance, reps[0]!, reps[1]!, reps[2]!];
    }
    const distance = reps[0]! + 1;
    for (const end = Math.min(out.length, done + count); done < end; done++) out[done] = out[done - distance]!;
  }
  return out;
}
