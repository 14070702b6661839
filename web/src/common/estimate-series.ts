/** An estimate's columns as curves, bands and stretches; NaN stands where nothing can be told. */
import type { Line, Range, Shade } from "../components/chart-series";
import type { EstimateSummary, SeriesPart } from "../data/estimate-types";
import type { Posture } from "../data/types";

const QUANTILES = ["p05", "p50", "p95"] as const;
/** Half the width of a normal distribution's 5 to 95 %, in standard deviations. */
const Z95 = 1.6449;
/** Joints whose efforts are drawn. */
export const JOINTS_SHOWN = 5;
const AXES = ["x", "y", "z"] as const;

/** A quantity over time with its band. */
export interface Course {
  times: number[];
  low: number[];
  middle: number[];
  high: number[];
}

type Columns = SeriesPart["columns"];

/** A column as numbers; yes and no are 1 and 0. */
export function numbers(columns: Columns, name: string): number[] {
  const length = columns["time_s"]?.length ?? 0;
  const column = columns[name];
  if (!column) return new Array<number>(length).fill(NaN);
  return column.map((value) => (value === null || typeof value === "string" ? NaN : Number(value)));
}

/** Names of the columns that the plots draw, of those that the estimate has. */
export function plottedColumns(estimate: EstimateSummary): string[] {
  const vectors = ["force", "force_sd", "moment", "moment_sd"].flatMap((quantity) => {
    const unit = quantity.startsWith("force") ? "n" : "nm";
    return AXES.map((axis) => `l5s1_${quantity}_${axis}_${unit}`);
  });
  const wanted = [
    "doubtful",
    ...QUANTILES.map((q) => `payload_${q}_kg`),
    "right_hand_payload_kg",
    "left_hand_payload_kg",
    ...estimate.efforts
      .slice(0, JOINTS_SHOWN)
      .flatMap(({ joint }) => QUANTILES.map((q) => `${joint}_effort_${q}_nm`)),
    ...vectors,
    "right_foot_force_z_n",
    "left_foot_force_z_n",
  ];
  const there = new Set(estimate.columns);
  return wanted.filter((name) => there.has(name));
}

/** Names of the columns that the body is played from. */
export function postureColumns(estimate: EstimateSummary): string[] {
  return estimate.columns.filter((name) => /^pelvis_|_angle_rad$|_effort_p50_nm$/.test(name));
}

/**
 * The columns with a row of nothing wherever frames were left out, so that no curve leads across.
 */
export function withGaps(columns: Columns): Columns {
  const times = numbers(columns, "time_s");
  const steps = times.slice(1).map((time, i) => time - times[i]!);
  const step = [...steps].sort((a, b) => a - b)[steps.length >> 1] ?? 0;
  const before = steps.flatMap((each, i) => (each > 1.5 * step ? [i] : []));
  if (before.length === 0) return columns;
  const widened = (name: string, column: Columns[string]): Columns[string] => {
    let from = 0;
    const parts = before.flatMap((index) => {
      const part = column.slice(from, index + 1);
      from = index + 1;
      return [...part, name === "time_s" ? times[index]! + step : null];
    });
    return [...parts, ...column.slice(from)];
  };
  return Object.fromEntries(
    Object.entries(columns).map(([name, column]) => [name, widened(name, column)]),
  );
}

/** A quantity that has quantiles, such as `payload` in `kg`. */
export function course(columns: Columns, name: string, unit: string): Course {
  const [low, middle, high] = QUANTILES.map((q) => numbers(columns, `${name}_${q}_${unit}`));
  return { times: numbers(columns, "time_s"), low: low!, middle: middle!, high: high! };
}

/**
 * The size of a vector with its band, to first order along the vector and without the axes'
 * covariances, as the summary's own figures.
 */
export function sizeCourse(columns: Columns, name: string, unit: string): Course {
  const vector = AXES.map((axis) => numbers(columns, `${name}_${axis}_${unit}`));
  const spread = AXES.map((axis) => numbers(columns, `${name}_sd_${axis}_${unit}`));
  const times = numbers(columns, "time_s");
  const middle = times.map((_, i) => Math.hypot(...vector.map((axis) => axis[i]!)));
  const half = middle.map(
    (size, i) =>
      (Z95 * Math.hypot(...vector.map((axis, k) => axis[i]! * spread[k]![i]!))) /
      Math.max(size, 1e-9),
  );
  return {
    times,
    low: middle.map((size, i) => Math.max(0, size - half[i]!)),
    middle,
    high: middle.map((size, i) => size + half[i]!),
  };
}

/** Stretches in which a yes-no question is answered with yes; each goes on to the next frame. */
export function stretches(
  times: readonly number[],
  yes: (index: number) => boolean,
): { from: number; to: number }[] {
  const found: { from: number; to: number }[] = [];
  let start = -1;
  for (let index = 0; index <= times.length; index++) {
    const now = index < times.length && yes(index);
    if (now && start < 0) start = index;
    if (!now && start >= 0) {
      found.push({ from: times[start]!, to: times[Math.min(index, times.length - 1)]! });
      start = -1;
    }
  }
  return found;
}

/** What to shade behind some curves: hatched where none is known, grey where the motion is doubtful. */
export function shadesOf(columns: Columns, ...curves: readonly (readonly number[])[]): Shade[] {
  const times = numbers(columns, "time_s");
  const doubtful = numbers(columns, "doubtful");
  return [
    ...stretches(times, (i) => doubtful[i] === 1).map((one) => ({
      ...one,
      kind: "doubtful" as const,
    })),
    ...stretches(times, (i) => curves.every((values) => !Number.isFinite(values[i]))).map(
      (one) => ({ ...one, kind: "unknown" as const }),
    ),
  ];
}

export const mainLine = (label: string, of: Course): Line[] => [
  { label, times: of.times, values: of.middle, kind: "main" },
];

/** The band of a course; null where it has none. */
export const bandOf = (of: Course): Range | null =>
  of.low.some(Number.isFinite)
    ? { label: "5–95 %", times: of.times, low: of.low, high: of.high }
    : null;

/** The body over time; its joints are coloured on one scale, up to the greatest effort of all. */
export function postureOf(columns: Columns, scaleNm: number): Posture {
  const times = numbers(columns, "time_s");
  const rows = (names: readonly string[]): number[][] => {
    const each = names.map((name) => numbers(columns, name));
    return times.map((_, i) => each.map((values) => values[i]!));
  };
  const names = Object.keys(columns);
  const ending = (suffix: string) =>
    names.filter((name) => name.endsWith(suffix)).map((name) => name.slice(0, -suffix.length));
  const joints = ending("_effort_p50_nm");
  const dofs = ending("_angle_rad");
  return {
    time_s: times,
    joint_names: dofs,
    joint_position: rows(dofs.map((dof) => `${dof}_angle_rad`)),
    base: {
      position_m: rows(AXES.map((axis) => `pelvis_position_${axis}_m`)),
      orientation_xyzw: rows([...AXES, "w"].map((axis) => `pelvis_orientation_${axis}`)),
    },
    effort_p50_nm: Object.fromEntries(
      joints.map((joint) => [joint, numbers(columns, `${joint}_effort_p50_nm`)]),
    ),
    effort_scale_nm: Object.fromEntries(joints.map((joint) => [joint, scaleNm])),
  };
}
