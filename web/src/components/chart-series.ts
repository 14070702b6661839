import { resample, unionOfTimes } from "../common/align-series";
import { keepExtremes } from "../common/down-sample";

/** One curve of a chart. */
export interface Line {
  label: string;
  times: readonly number[];
  values: readonly number[];
  /** `main` is the answer, `compare` another candidate; `edge` bounds a band. */
  kind: "main" | "compare" | "edge";
  /** Holds its value until the next sample, as scores do. */
  stepped?: boolean;
}

/** The band around the main curve. */
export interface Range {
  label: string;
  times: readonly number[];
  low: readonly number[];
  high: readonly number[];
}

/** A shaded stretch of the value axis. */
export interface Zone {
  from: number;
  to: number;
  /** CSS variable with its colour. */
  colour: string;
  label: string;
}

/** A stretch of time to shade: where nothing is known, or where what is drawn is doubtful. */
export interface Shade {
  from: number;
  to: number;
  kind: "unknown" | "doubtful";
}

/** What uPlot draws: the curves in order, the band's two edges first, all over one time axis. */
export interface ChartData {
  lines: Line[];
  columns: [number[], ...(number | null)[][]];
}

/** Puts curves of different lengths over one axis and thins very long ones without losing extremes. */
export function chartData(lines: readonly Line[], range: Range | null, buckets = 1500): ChartData {
  const all: Line[] = [...lines];
  if (range) {
    const { label, times } = range;
    all.unshift(
      { label: `${label}, high`, times, values: range.high, kind: "edge" },
      { label: `${label}, low`, times, values: range.low, kind: "edge" },
    );
  }
  const thinned = all.map((line) => thin(line, buckets));
  const times = unionOfTimes(thinned.map((line) => line.times));
  return { lines: all, columns: [times, ...thinned.map((line) => resample(line, times))] };
}

function thin(line: Line, buckets: number): Line {
  const kept = keepExtremes([line.values], buckets);
  if (kept.length === line.values.length) return line;
  return {
    ...line,
    times: kept.map((index) => line.times[index]!),
    values: kept.map((index) => line.values[index]!),
  };
}
