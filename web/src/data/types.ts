/**
 * What the service sends and takes, in its own spelling (snake case, SI units, quaternions xyzw).
 * Degrees appear only in fields that say so.
 */

export interface Problem {
  type: string;
  title: string;
  status: number;
  detail?: string;
  instance?: string;
  errors?: ProblemItem[];
}

export interface ProblemItem {
  pointer?: string;
  detail?: string;
  expected?: unknown;
  got?: unknown;
}

export interface Subject {
  height_m: number | null;
  mass_kg: number | null;
  sex: string | null;
}

export interface ModelSummary {
  id: string;
  name: string;
  subject: Subject;
  hand: string;
  method: string;
  created: string;
  metrics: Record<string, unknown>;
}

export interface CostPart {
  name: string;
  value: number;
  unit: string;
  weight: number;
  /** What it adds to the total. */
  contribution: number;
  aggregation?: string;
  direction?: string;
}

/** Quantiles over time; every array has one entry for each of `time_s`. */
export interface Band {
  p05: number[];
  p50: number[];
  p95: number[];
}

export interface ScoreBand {
  time_s: number[];
  pmf: number[][];
  expected: number[];
  p05: number[];
  p95: number[];
  p_ge_5?: number[];
}

export interface Moment {
  time_s: number;
  body_part?: string;
  side?: string;
  reason?: string;
  reasons?: string[];
  score?: number;
  rula?: number;
  effort_nm?: number | null;
  effort_joint?: string | null;
}

export interface Assumption {
  what: string;
  value: unknown;
  range: unknown;
  effect: string;
}

export interface OutOfDistribution {
  flag: boolean;
  familiarity_min?: number | null;
  time_s?: number | null;
}

export interface Candidate {
  id: string;
  rank: number | null;
  p_best: number | null;
  tied_with: string[];
  cost: { total: number; parts: CostPart[] } | null;
  rula: ScoreBand | null;
  reba: ScoreBand | null;
  back_angle_deg: (Band & { time_s: number[] }) | null;
  effort_nm: Record<string, Band> | null;
  worst: Moment | null;
  moments: Moment[] | null;
  assumed: Assumption[] | null;
  out_of_distribution: OutOfDistribution | null;
  baseline: Record<string, BaselineResult> | null;
  problem: Problem | null;
}

export interface BaselineResult {
  rula_expected_mean: number | null;
  cost_total: number | null;
}

export interface Assessment {
  id: string;
  name?: string | null;
  model_id: string;
  created: string;
  seed: number;
  samples: number;
  methods: string[];
  cost_definition: unknown;
  /** What holds for every candidate; each adds its own. */
  assumed?: Assumption[];
  candidates: Candidate[];
}

export interface AssessmentSummary {
  id: string;
  name?: string | null;
  created: string;
  model_id: string;
  n_candidates: number;
}

/** Where the pelvis is over time, in the world. */
export interface BasePath {
  position_m: number[][];
  orientation_xyzw: number[][];
}

/** Postures over time, to be played on the body: one row of `joint_position` per frame. */
export interface Posture {
  time_s: number[];
  joint_names: string[];
  joint_position: number[][];
  samples?: number[][][] | null;
  base: BasePath;
  /** The pelvis of each of the samples; that of `base` if not given. */
  samples_base?: BasePath[] | null;
  effort_p50_nm?: Record<string, number[]> | null;
  effort_scale_nm?: Record<string, number> | null;
  target?: { position_m: number[][] } | null;
}

export interface RecordingSummary {
  id: string;
  name: string;
  format: string;
  inspection?: Record<string, unknown>;
  /** What was added to it, such as force plates. */
  files?: { role: string; name: string }[];
}

export interface ScoreSummary {
  median: number;
  p90: number;
  max: number;
  time_at_or_above: Record<string, number>;
  time_of_max_s: number;
}

export interface ScoreSide {
  rula: number[];
  reba: number[];
}

export interface ScoreResult {
  id: string;
  recording_id: string;
  time_s: number[];
  sides: { left: ScoreSide; right: ScoreSide };
  rula: number[];
  reba: number[];
  back_angle_deg: number[];
  summary: { rula: ScoreSummary; reba: ScoreSummary };
  worst: Moment[];
  assumed: Assumption[];
  model_urdf_url: string;
  posture: Posture;
}

export interface ScoreRequest {
  recording_id: string;
  height_m?: number;
  mass_kg?: number;
  sex?: string;
  hand_load_kg?: number;
}

export interface Operation {
  id: string;
  state: "queued" | "running" | "succeeded" | "failed" | "cancelled";
  progress?: { done?: number; total?: number; message?: string } | null;
  result_url?: string | null;
  problem?: Problem | null;
}

export interface Items<T> {
  items: T[];
}
