import { placeOf } from "./time-lookup";

export interface Timed {
  times: readonly number[];
  values: readonly number[];
}

/** Sorted times that occur in any of the lists, each once. */
export function unionOfTimes(lists: readonly (readonly number[])[]): number[] {
  const all = new Set<number>();
  for (const list of lists) for (const time of list) all.add(time);
  return [...all].sort((a, b) => a - b);
}

/**
 * Values of a series at other times: linear inside its own support, null outside and wherever a
 * neighbour is not known (not a number).
 *
 * Plots of candidates that last differently share one axis this way, and none is drawn past its end.
 */
export function resample(series: Timed, times: readonly number[]): (number | null)[] {
  const { times: own, values } = series;
  if (own.length === 0) return times.map(() => null);
  const first = own[0]!;
  const last = own[own.length - 1]!;
  return times.map((time) => {
    if (time < first || time > last) return null;
    const { index, fraction } = placeOf(own, time);
    const here = values[index]!;
    const value = fraction === 0 ? here : here + fraction * (values[index + 1]! - here);
    return Number.isNaN(value) ? null : value;
  });
}
