// Numbers as the page shows them.

export const degrees = (radians) => (radians * 180) / Math.PI;

/** In so many significant digits, without an exponent where that is short. */
export function short(x, digits = 3) {
  const size = Math.abs(x);
  if (x === 0) {
    return "0";
  }
  if (!Number.isFinite(x)) {
    return "–";
  }
  if (size < 1e-3 || size >= 1e5) {
    return x.toExponential(digits - 2);
  }
  return x.toFixed(Math.min(Math.max(digits - 1 - Math.floor(Math.log10(size)), 0), 6));
}

/** A length in the unit that suits it. */
export function metres(x) {
  if (x === null || !Number.isFinite(x)) {
    return "–";
  }
  const size = Math.abs(x);
  if (size >= 1 || size === 0) {
    return `${x.toFixed(3)} m`;
  }
  return size >= 1e-3 ? `${(1e3 * x).toFixed(1)} mm` : `${x.toExponential(1)} m`;
}
