/**
 * Indices to draw of a long series so that no extreme of any column is lost.
 *
 * Cuts the samples into equal buckets and keeps, per bucket and column, the lowest and the highest
 * sample, with the first and last of all: a peak of a single frame stays visible however far one
 * zooms out, which averaging or picking every n-th sample would hide. Of values that are not known
 * (not a number) each bucket keeps one, so that a gap stays a gap.
 *
 * @param columns Series of one length.
 * @param buckets Number of buckets; about twice the pixels of the plot is plenty.
 */
export function keepExtremes(columns: readonly ArrayLike<number>[], buckets: number): number[] {
  const length = columns[0]?.length ?? 0;
  const all = () => Array.from({ length }, (_, index) => index);
  if (length <= buckets * columns.length * 2 || buckets < 1) return all();
  const kept = new Set<number>([0, length - 1]);
  for (let bucket = 0; bucket < buckets; bucket++) {
    const from = Math.floor((bucket * length) / buckets);
    const to = Math.floor(((bucket + 1) * length) / buckets);
    for (const column of columns) {
      let lowest = from;
      let highest = from;
      let gap = -1;
      for (let index = from; index < to; index++) {
        const value = column[index]!;
        if (Number.isNaN(value)) {
          if (gap < 0) gap = index;
          continue;
        }
        if (!(value >= column[lowest]!)) lowest = index;
        if (!(value <= column[highest]!)) highest = index;
      }
      if (gap >= 0) kept.add(gap);
      kept.add(lowest);
      kept.add(highest);
    }
  }
  return [...kept].sort((a, b) => a - b);
}
