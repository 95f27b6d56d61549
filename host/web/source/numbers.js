// Numbers as the page shows and finds them.

export const degrees = (angle) => (angle * 180) / Math.PI;
export const radians = (angle) => (angle * Math.PI) / 180;

/** The indices before and after a time among so many rising times, and the share of the way between them. */
export function bracket(timeAt, count, time) {
  let [low, high] = [0, count - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    [low, high] = timeAt(middle) <= time ? [middle, high] : [low, middle];
  }
  const width = timeAt(high) - timeAt(low);
  return [low, high, width > 0 ? Math.min(Math.max((time - timeAt(low)) / width, 0), 1) : 0];
}

/** Decimals that show so many significant digits of a number. */
export const decimalsOf = (x, digits) =>
  Math.max(digits - 1 - Math.floor(Math.log10(Math.abs(x) || 1) + 1e-9), 0);

/** In so many decimals, without the sign of a zero; many decimals become an exponent. */
export function fixed(x, decimals) {
  const rounded = Number(x.toFixed(decimals)) || 0;
  return decimals > 5 && rounded ? rounded.toExponential(1) : rounded.toFixed(Math.min(decimals, 5));
}

export const percent = (share) => `${fixed(100 * share, share < 0.1 ? 1 : 0)} %`;

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
  return x.toFixed(Math.min(decimalsOf(size, digits), 6));
}

/** A length in the unit that suits it; none is told below a micrometre. */
export function metres(x) {
  if (x === null || !Number.isFinite(x)) {
    return "–";
  }
  const size = Math.abs(x);
  if (size < 1e-6) {
    return "< 1 µm";
  }
  if (size < 1e-3) {
    return `${(1e6 * x).toFixed(0)} µm`;
  }
  return size < 1 ? `${(1e3 * x).toFixed(1)} mm` : `${x.toFixed(3)} m`;
}
