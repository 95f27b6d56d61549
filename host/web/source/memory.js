// Structures of remora.h in WebAssembly's memory, read and written by the names of their members.

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
    return this.structures[type]?.size ?? (type === "double" || type === "uint64_t" ? 8 : 4);
  }

  #number(type, at) {
    const view = new DataView(this.memory.buffer);
    switch (type) {
      case "double":
        return view.getFloat64(at, true);
      case "uint64_t":
        return view.getBigUint64(at, true);
      default:
        return this.structures[type] ? this.read(type, at) : view.getUint32(at, true);
    }
  }

  #put(type, at, value) {
    const view = new DataView(this.memory.buffer);
    switch (type) {
      case "double":
        view.setFloat64(at, value, true);
        break;
      case "uint64_t":
        view.setBigUint64(at, BigInt(value), true);
        break;
      default:
        this.structures[type] ? this.write(type, at, value) : view.setUint32(at, value, true);
    }
  }
}
