/** Sums and quantiles of score distributions; entry `k` of a pmf is the probability of score `first + k`. */

/** Probability that the score is `score` or more. */
export function atLeast(pmf: readonly number[], score: number, first = 1): number {
  let sum = 0;
  for (let k = Math.max(0, score - first); k < pmf.length; k++) sum += pmf[k]!;
  return Math.min(1, Math.max(0, sum));
}

/** Smallest score whose cumulative probability reaches `probability`. */
export function quantile(pmf: readonly number[], probability: number, first = 1): number {
  let sum = 0;
  for (let k = 0; k < pmf.length; k++) {
    sum += pmf[k]!;
    // Rounding must not push a quantile one score up when the mass sums to it exactly.
    if (sum >= probability - 1e-9) return first + k;
  }
  return first + pmf.length - 1;
}

/** Mean over time by the trapezoid rule; plain value for a single sample. */
export function meanOverTime(times: readonly number[], values: readonly number[]): number {
  const last = times.length - 1;
  if (last < 0) return Number.NaN;
  const span = times[last]! - times[0]!;
  if (last === 0 || span <= 0) return values[0]!;
  let area = 0;
  for (let i = 0; i < last; i++) {
    area += 0.5 * (values[i]! + values[i + 1]!) * (times[i + 1]! - times[i]!);
  }
  return area / span;
}
