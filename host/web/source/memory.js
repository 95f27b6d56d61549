// Structures of remora.h in WebAssembly's memory, read and written by the names of their members.

/** Types of eight bytes by their names in a view of memory; others are unsigned and have four. */
const WIDE = { double: "Float64", uint64_t: "BigUint64" };

export class Memory {
  /** Of an instance, whose memory grows by what is asked for. */
  constructor(memory, layouts) {
    this.memory = memory;
    this.structures = layouts.structures;
  }

  /** Fresh memory behind all that the instance uses, at a multiple of 64 KiB. */
  reserve(bytes) {
    return this.memory.grow(Math.ceil(bytes / 65536)) * 65536;
  }

  /** The members of a structure; 64-bit integers as BigInt, text as a string. */
  read(name, at) {
    const members = Object.entries(this.structures[name].members);
    return Object.fromEntries(members.map(([member, place]) => [member, this.#value(at, place)]));
  }

  /** Sets members of a structure, and its size. Members that are not given stay. */
  write(name, at, values) {
    const { size, members } = this.structures[name];
    const given = members.size ? { ...values, size } : values;
    for (const [member, value] of Object.entries(given)) {
      if (!members[member]) {
        throw new Error(`${name} has no member ${member}`);
      }
      this.#set(at, members[member], value);
    }
  }

  #value(at, { at: offset, type, counts }) {
    if (type === "char") {
      const bytes = new Uint8Array(this.memory.buffer, at + offset, counts[0]);
      return String.fromCharCode(...bytes.subarray(0, bytes.indexOf(0)));
    }
    return this.#elements(at + offset, type, counts, (place) => this.#number(type, place));
  }

  #set(at, { at: offset, type, counts }, value) {
    const flat = [value].flat(counts.length);
    let next = 0;
    this.#elements(at + offset, type, counts, (place) => this.#put(type, place, flat[next++]));
    if (next !== flat.length) {
      throw new Error(`${flat.length} values for ${next} places`);
    }
  }

  /** Does something at the place of each element, rows first. */
  #elements(at, type, [count, ...inner], what) {
    if (count === undefined) {
      return what(at);
    }
    const size = this.#size(type) * inner.reduce((product, n) => product * n, 1);
    return Array.from({ length: count }, (_, i) => this.#elements(at + i * size, type, inner, what));
  }

  #size(type) {
    return this.structures[type]?.size ?? (WIDE[type] ? 8 : 4);
  }

  #number(type, at) {
    return this.structures[type] ? this.read(type, at) : this.#view()[`get${WIDE[type] ?? "Uint32"}`](at, true);
  }

  #put(type, at, value) {
    if (this.structures[type]) {
      return this.write(type, at, value);
    }
    const number = type === "uint64_t" ? BigInt(value) : value;
    return this.#view()[`set${WIDE[type] ?? "Uint32"}`](at, number, true);
  }

  /** The memory as it is now: growing replaces it. */
  #view() {
    return new DataView(this.memory.buffer);
  }
}
