/** Where a time falls in an increasing list of times. */
export interface TimePlace {
  /** Index of the sample at or before the time (clamped to the list). */
  index: number;
  /** How far towards the next sample, 0 to 1; 0 at the last one. */
  fraction: number;
}

/** Finds the place of `time` by bisection; times outside the list are clamped to its ends. */
export function placeOf(times: ArrayLike<number>, time: number): TimePlace {
  const last = times.length - 1;
  if (last < 0) throw new RangeError("placeOf: there are no times to look in");
  if (!(time > times[0]!)) return { index: 0, fraction: 0 };
  if (time >= times[last]!) return { index: last, fraction: 0 };
  let low = 0;
  let high = last;
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (times[middle]! <= time) low = middle;
    else high = middle;
  }
  return { index: low, fraction: (time - times[low]!) / (times[high]! - times[low]!) };
}

/** The value at `time`, linear between samples. */
export function valueAt(times: ArrayLike<number>, values: ArrayLike<number>, time: number): number {
  const { index, fraction } = placeOf(times, time);
  const here = values[index]!;
  if (fraction === 0) return here;
  return here + fraction * (values[index + 1]! - here);
}

/** The value of the sample nearest in time: for scores and other whole numbers, which have no between. */
export function nearestValue(
  times: ArrayLike<number>,
  values: ArrayLike<number>,
  time: number,
): number {
  const { index, fraction } = placeOf(times, time);
  return values[fraction > 0.5 ? index + 1 : index]!;
}
