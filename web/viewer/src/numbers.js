// Numbers as people read them: as short as they can be, and never rounded to another number that is stored.

/** Digits that a decimal number keeps on its way through a double. */
const exactDigits = 15;

/** A number without the noise of sums and products of doubles; or with few digits, for what is only measured. */
export function numberText(number, digits = exactDigits) {
  return Number.isFinite(number) ? String(Number(number.toPrecision(digits))) : String(number);
}

/** The shortest decimal number that leads to the same float32, or the number itself if that is another type. */
function shortest(sample, isFloat32) {
  if (sample === 0) return Object.is(sample, -0) ? "-0" : "0";
  if (!isFloat32 || !Number.isFinite(sample)) return String(sample);
  let digits = 1;
  while (Math.fround(Number(sample.toPrecision(digits))) !== sample) ++digits;
  return numberText(sample, digits);
}

/** A sample of an array, as it is stored. */
export const sampleText = (sample, type) => shortest(sample, type === "float32");

/** `slope * sample + intercept`, in as many digits as there are. */
export function valueText(sample, type, { slope, intercept }) {
  if (slope === 1 && intercept === 0) return sampleText(sample, type);
  const value = slope * sample + intercept;
  return type === "float64" ? String(value) : numberText(value);
}

/**
 * A number that is a sum of numbers up to `largest`, to a ten millionth of `step`, which is the distance of two such
 * numbers that differ; without zeros at its end.
 */
export function placeText(number, step, largest = Math.abs(number)) {
  if (!Number.isFinite(number)) return String(number);
  const power = (x) => (x > 0 ? Math.floor(Math.log10(x)) : 0);
  const decimals = Math.min(7 - power(step), exactDigits - 1 - power(largest));
  return String(Number(number.toFixed(Math.min(Math.max(decimals, 0), 100))));
}

/** A number that was measured, where `step` is what can just be told apart: to a fifth of it or somewhat more. */
export function measuredText(number, step) {
  const decimals = Math.ceil(-Math.log10(step / 5) - 1e-9);
  return Number.isFinite(number) ? number.toFixed(Math.min(Math.max(decimals, 0), 20)) : String(number);
}
