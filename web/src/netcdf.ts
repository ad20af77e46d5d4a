/** Columns out of the netCDF files that `stickslip` writes: HDF5 with columns in one piece, not packed. Format: The HDF Group, “HDF5 File Format Specification 3.0”. */

/** Nothing stands there. */
const NOWHERE = 2 ** 64;

/** The columns of numbers by their names, those of a group by `group/name`; null where the file is none or is written in another way. */
export function columnsOf(bytes: ArrayBuffer): Map<string, Float64Array> | null {
  const view = new DataView(bytes);
  const size = (at: number, bits = 64): number => (bits === 8 ? view.getUint8(at) : bits === 16 ? view.getUint16(at, true) : bits === 32 ? view.getUint32(at, true) : Number(view.getBigUint64(at, true)));
  const word = (at: number, length: number) => new TextDecoder().decode(new Uint8Array(bytes, at, length));
  const found = new Map<string, Float64Array>();

  /** The messages of an object: where the body of each begins, by its kind. */
  const messages = (object: number): [kind: number, at: number][] => {
    const all: [number, number][] = [];
    const read = (at: number, end: number, head: number, flags: number) => {
      while (at + head <= end) {
        const [kind, length] = head === 8 ? [size(at, 16), size(at + 2, 16)] : [size(at, 8), size(at + 1, 16)];
        const body = at + head;
        if (kind === 16) read(size(body) + (head === 8 ? 0 : 4), size(body) + size(body + 8) - (head === 8 ? 0 : 4), head, flags);
        else all.push([kind, body]);
        at = body + length;
      }
    };
    if (word(object, 4) === "OHDR") {
      const flags = size(object + 5, 8);
      const at = object + 6 + (flags & 32 ? 16 : 0) + (flags & 16 ? 4 : 0);
      const wide = 1 << (flags & 3);
      read(at + wide, at + wide + size(at, 8 * wide), flags & 4 ? 6 : 4, flags);
    } else read(object + 16, object + 16 + size(object + 8, 32), 8, 0);
    return all;
  };

  /** A link: its name, the object and where it ends; null where there is none. */
  const link = (at: number): [name: string, object: number, end: number] | null => {
    if (size(at, 8) !== 1) return null;
    const flags = size(at + 1, 8);
    let to = at + 2 + (flags & 8 ? 1 : 0) + (flags & 4 ? 8 : 0) + (flags & 16 ? 1 : 0);
    const wide = 1 << (flags & 3);
    const length = size(to, 8 * wide);
    to += wide;
    return [word(to, length), size(to + length), to + length + 8];
  };

  /** The links of a heap, block by block. */
  const heap = (at: number): [string, number][] => {
    const links: [string, number][] = [];
    const before = 13 + Math.ceil(size(at + 128, 16) / 8);
    const block = (from: number, length: number) => {
      let place = from + before + (size(at + 9, 8) & 2 ? 4 : 0);
      for (let next; place < from + length && (next = link(place)); place = next[2]) links.push([next[0], next[1]]);
    };
    const [width, first, root, rows] = [size(at + 110, 16), size(at + 112), size(at + 132), size(at + 140, 16)];
    if (!rows) block(root, first);
    for (let i = 0; i < rows * width; i++) {
      const from = size(root + before + 8 * i);
      if (from < NOWHERE) block(from, first * 2 ** Math.max(0, Math.floor(i / width) - 1));
    }
    return links;
  };

  const column = (parts: Map<number, number>, name: string) => {
    const [space, type, layout] = [1, 3, 8].map((kind) => parts.get(kind)!) as [number, number, number];
    // One axis, numbers, in one piece and nothing packed.
    const [kind, wide] = [size(type, 8) & 15, size(type + 4, 32)];
    if (size(space + 1, 8) !== 1 || size(layout, 8) !== 3 || size(layout + 1, 8) !== 1 || parts.has(11)) return;
    const count = size(space + (size(space, 8) === 1 ? 8 : 4));
    const from = size(layout + 2);
    const little = !(size(type + 1, 8) & 1);
    if (kind > 1 || from + wide * count > bytes.byteLength) return;
    const one = (at: number) => (kind ? (wide === 8 ? view.getFloat64(at, little) : view.getFloat32(at, little)) : wide === 8 ? Number(view.getBigInt64(at, little)) : wide === 4 ? view.getInt32(at, little) : wide === 2 ? view.getInt16(at, little) : view.getInt8(at));
    const all = new Float64Array(count);
    for (let i = 0; i < count; i++) all[i] = one(from + wide * i);
    found.set(name, all);
  };

  const visit = (object: number, path: string, depth: number) => {
    const all = messages(object);
    const parts = new Map(all);
    if (parts.has(8)) return column(parts, path.slice(1));
    if (depth > 2) return;
    const links = all.flatMap(([kind, at]): [string, number][] => {
      if (kind === 6) return [link(at)!.slice(0, 2) as [string, number]];
      const to = kind === 2 ? size(at + 2 + (size(at + 1, 8) & 1 ? 8 : 0)) : NOWHERE;
      return to < NOWHERE ? heap(to) : [];
    });
    for (const [name, at] of links) visit(at, `${path}/${name}`, depth + 1);
  };

  try {
    if (word(1, 3) !== "HDF") return null;
    visit(size(size(8, 8) < 2 ? 64 : 36), "", 0);
  } catch (error) {
    if (!(error instanceof RangeError)) throw error; // it points beyond its end
  }
  return found.size ? found : null;
}
