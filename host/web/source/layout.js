// Where the members of remora.h's structures lie in WebAssembly's memory, read from the header when the page is
// built. A wrong size would be refused by the planner, a wrong place would change checksums.

const SIZES = { uint32_t: 4, size_t: 4, char: 1, double: 8, uint64_t: 8 };
// Codes, by the names of their enumerations, are numbers of 32 bits.
const CODE = /typedef uint32_t (\w+);/g;
const POINTER = 4;

/** Structures by name, each with its size and, by member, where it lies and what it is. */
export function layoutsOf(header) {
  const text = header.replace(/\/\/.*$|\/\*[\s\S]*?\*\//gm, "");
  const constants = Object.fromEntries(
    [...text.matchAll(/#define (REMORA_\w+) (\d+)(?:ull)?$/gm)].map(([, name, number]) => [name, number]),
  );
  const codes = Object.fromEntries([...text.matchAll(CODE)].map(([, name]) => [name, { size: 4, alignment: 4 }]));
  const structures = {};
  for (const [, name, body] of text.matchAll(/typedef struct (\w+) \{([^}]*)\}/g)) {
    structures[name] = structure(body, constants, { ...codes, ...structures });
  }
  return { constants, structures };
}

function structure(body, constants, structures) {
  const members = {};
  let [end, alignment] = [0, 1];
  for (const declaration of body
    .split(";")
    .map((text) => text.trim())
    .filter(Boolean)) {
    const { name, type, counts } = member(declaration, constants);
    const { size, alignment: own } = measure(type, structures);
    const at = Math.ceil(end / own) * own;
    members[name] = { at, type, counts };
    end = at + size * counts.reduce((product, count) => product * count, 1);
    alignment = Math.max(alignment, own);
  }
  return { size: Math.ceil(end / alignment) * alignment, alignment, members };
}

/** Name, type and numbers of elements of what a line declares. */
function member(declaration, constants) {
  const callback = declaration.match(/\(\*(\w+)\)/);
  if (callback) {
    return { name: callback[1], type: "pointer", counts: [] };
  }
  const parts = declaration.match(/^(?:const )?(?:struct )?(\w+) (\*?)(\w+)((?:\[\w+\])*)$/);
  if (!parts) {
    throw new Error(`remora.h: not understood: ${declaration}`);
  }
  const [, type, star, name, brackets] = parts;
  const counts = [...brackets.matchAll(/\[(\w+)\]/g)].map(([, count]) => Number(constants[count] ?? count));
  return { name, type: star ? "pointer" : type, counts };
}

function measure(type, structures) {
  if (type === "pointer") {
    return { size: POINTER, alignment: POINTER };
  }
  const size = SIZES[type];
  if (size === undefined && !structures[type]) {
    throw new Error(`remora.h: unknown type ${type}`);
  }
  return structures[type] ?? { size, alignment: size };
}
