// Made by python -m bench.pages from companion/view/values.py. Do not edit.

/**
 * Where the boat is expected ``in_s`` from now, and on which tack; nine in ten are within ``within_m`` of there.
 */
export interface Ahead {
  in_s: number;
  at_en_m: [number, number];
  tack: "port" | "starboard" | null;
  within_m: number | null;
}

/**
 * Something that somebody should look at: since ``age_s``.
 */
export interface Alarm {
  code: string;
  level: "critical" | "error" | "info" | "notice" | "warning";
  text: string;
  age_s: number | null;
}

/**
 * Obstacles as drawn, as grown by the margin, and the limits: polygons, each an outer ring and its holes.
 *
 *     Metres east and north of ``origin_lat_deg`` and ``origin_lon_deg``; ``lat_m`` and ``lon_m`` are the metres in a
 *     degree there. ``names`` are the obstacles', one each: of the mission's file, else "obstacle N". ``drying`` is
 *     solid at its hours. ``hash`` names the content.
 */
export interface Area {
  name: string;
  origin_lat_deg: number;
  origin_lon_deg: number;
  lat_m: number;
  lon_m: number;
  hash: string;
  obstacles: [number, number][][][];
  names: string[];
  grown: [number, number][][][];
  limits: [number, number][][][];
  drying: Drying[];
  margin_m: number | null;
}

/**
 * The forecast at a horizon; ``half_deg``: half widths of the central intervals of ``Wind.levels``.
 */
export interface Band {
  horizon_s: number;
  twd_from_deg: number;
  sigma_deg: number;
  tws_mps: number;
  tws_sigma_mps: number;
  half_deg: number[];
}

/**
 * Place and motion of the boat. ``age_s``: of the position. ``cross_track_m`` is positive right of the leg.
 */
export interface Boat {
  age_s: number | null;
  lat_deg: number | null;
  lon_deg: number | null;
  at_en_m: [number, number] | null;
  heading_deg: number | null;
  cog_deg: number | null;
  sog_mps: number | null;
  roll_deg: number | null;
  tack: "port" | "starboard" | null;
  vmg_mps: number | null;
  vmc_mps: number | null;
  clearance_m: number | null;
  cross_track_m: number | null;
  waypoint_m: number | null;
  goal_m: number | null;
  length_m: number | null;
  battery_v: number | null;
  battery_share: number | null;
}

/**
 * Water that dries: polygons as an obstacle's, and when it is solid.
 *
 *     ``solid_unix_s``: spans of Unix time [s] in order; where an end is None it has none.
 */
export interface Drying {
  name: string;
  shapes: [number, number][][][];
  solid_unix_s: ([number | null, number | null])[];
}

/**
 * Where runs end that do not arrive, and why.
 */
export interface End {
  at_en_m: [number, number];
  runs: number;
  why: string;
}

/**
 * Something that happened at ``t_s``; ``number`` counts them from 1, ``facts`` are the numbers behind it.
 *
 *     ``kind`` is phase, ask, plan, kept, upload, order, answer, mode, command or said.
 */
export interface Event {
  number: number;
  t_s: number;
  kind: string;
  title: string;
  unix_s: number | null;
  level: "critical" | "error" | "info" | "notice" | "warning";
  text: string;
  facts: [string, string][];
}

/**
 * A figure of the table (``companion.figures``): its value is m/s, m, s, degrees, a share of 1, or a number.
 *
 *     ``bearing`` is clockwise from north, ``angle`` positive to starboard.
 */
export interface Figure {
  name: string;
  label: string;
  kind: "angle" | "bearing" | "distance" | "number" | "share" | "speed" | "time";
  value: number;
  hint: string;
}

/**
 * The voyage so far.
 */
export interface Figures {
  time_s: number | null;
  distance_m: number | null;
  tacks: number | null;
  gybes: number | null;
  plans: number | null;
  replans: number | null;
  contacts: number | null;
  no_go_entries: number | null;
  min_clearance_m: number | null;
  promised_clearance_m: number | null;
  goals_reached: number | null;
  goals: number | null;
}

/**
 * A goal of the voyage: a point, a buoy to round (``side``), a line, a box, a search, or a place of a field.
 */
export interface Goal {
  name: string;
  kind: string;
  at_en_m: [number, number];
  radius_m: number | null;
  side: string;
  line_en_m: [[number, number], [number, number]] | null;
  is_next: boolean | null;
  is_reached: boolean | null;
  distance_m: number | null;
  bearing_deg: number | null;
}

/**
 * The places that she can be at after so many hours: lines.
 */
export interface Isochrone {
  hours: number;
  lines: [number, number][][];
}

/**
 * The course that fetches the mark on ``tack``, and how far it swings to either side with the wind.
 */
export interface Layline {
  tack: "port" | "starboard";
  course_deg: number;
  swing_deg: number;
  reach_s: number | null;
}

/**
 * The laylines of a mark that is sailed to against the wind, or before it (``is_beat`` False).
 */
export interface Laylines {
  name: string;
  mark_en_m: [number, number];
  is_beat: boolean;
  angle_deg: number;
  level: number;
  lines: Layline[];
}

/**
 * A leg of the plan as it was when it was made; the last may be the loiter at the end.
 */
export interface Leg {
  from_en_m: [number, number];
  to_en_m: [number, number];
  is_loiter: boolean;
  is_beat: boolean | null;
  course_deg: number | null;
  twa_deg: number | null;
  length_m: number | null;
  speed_mps: number | null;
  sigma_deg: number | null;
  no_go_half_deg: number | null;
  clearance_m: number | null;
  risk: number | null;
  manoeuvre: string;
}

/**
 * Wind and current at a place as she passes it, ``t_s`` after the departure.
 *
 *     ``north_deg`` is where true north is on the chart there: meridians come together.
 */
export interface Met {
  at_en_m: [number, number];
  north_deg: number;
  t_s: number;
  wind_from_deg: number;
  wind_mps: number;
  low_mps: number;
  high_mps: number;
  current_towards_deg: number | null;
  current_mps: number | null;
}

/**
 * The no-go zone: the boat's own half angle, and with the wind's spread so that it holds with ``probability``.
 */
export interface NoGo {
  half_deg: number;
  probability: number;
  wedges: Wedge[];
}

/**
 * The order that stands, the last answer, and what the mission permits whoever may open the socket on board.
 */
export interface Orders {
  standing: Standing | null;
  permitted: string[] | null;
  answer: string;
  answer_age_s: number | null;
}

/**
 * How a part of the whole is: when it was last heard of, and what is the matter with it.
 */
export interface Part {
  name: string;
  grade: "bad" | "good" | "poor" | "unknown";
  text: string;
  age_s: number | null;
}

/**
 * A planned passage on the chart: what it was planned to be, and never what is sailed by.
 *
 *     Times are seconds after the departure, ways metres along ``line`` (way, east, north). ``middle_m`` and each of
 *     ``members_m`` say how far along it a run is at ``at_s``, None where it has ended; ``band`` is polygons.
 */
export interface Passage {
  name: string;
  departs_unix_s: number;
  run_unix_s: number;
  until_unix_s: number;
  climate_unix_s: number | null;
  members: number;
  runs: number;
  arrived: number;
  low: number;
  high: number;
  waypoints: Waypoint[];
  line: [number, number, number][];
  band: [number, number][][][];
  at_s: number[];
  middle_m: (number | null)[];
  members_m: ((number | null)[])[];
  met: Met[];
  isochrones: Isochrone[];
  arrivals_s: number[];
  ends: End[];
  said: string[];
  binds: string[];
}

/**
 * Samples by column, each as long as ``t_s``; names as in ``Sample``.
 */
export interface Past {
  unix_s: number | null;
  t_s: number[];
  east_m: (number | null)[];
  north_m: (number | null)[];
  heading_deg: (number | null)[];
  sog_mps: (number | null)[];
  twd_from_deg: (number | null)[];
  tws_mps: (number | null)[];
  clearance_m: (number | null)[];
  starboard: (boolean | null)[];
  polar_twa_deg: (number | null)[];
  polar_mps: (number | null)[];
  ahead_twd_deg: (number | null)[];
  ahead_half_deg: (number | null)[];
  ahead_tws_mps: (number | null)[];
  ahead_tws_sigma_mps: (number | null)[];
}

/**
 * A place on the chart.
 */
export interface Place {
  name: string;
  at_en_m: [number, number];
  radius_m: number | null;
}

/**
 * The plan that is sailed: ``legs`` from the one that is next; what was promised, why it was chosen.
 *
 *     ``age_s``: since it was made, or held against a new one and kept; its wind and its times are of then.
 */
export interface Plan {
  number: number | null;
  age_s: number | null;
  reason: string;
  why: string;
  rung: string;
  bound_for: string;
  twd_from_deg: number | null;
  tws_mps: number | null;
  delta_s: number | null;
  promised_risk: number | null;
  path_risk: number | null;
  vessel_risk: number | null;
  margin_m: number | null;
  cost_s: number | null;
  median_s: number | null;
  late_s: number | null;
  there_s: number | null;
  there_late_s: number | null;
  expected_clearance_m: number | null;
  bound_s: number | null;
  replans: number | null;
  next_tack_s: number | null;
  next_tack_is_planned: boolean | null;
  leg: number | null;
  count: number | null;
  legs: Leg[];
}

/**
 * The speed by true wind angle in the wind of ``tws_mps``: nodes, linear between; best angles; the boat on it.
 *
 *     All of it over the water, in the current that is planned with.
 */
export interface Polar {
  name: string;
  tws_mps: number;
  twa_deg: number[];
  speed_mps: number[];
  beat_deg: number | null;
  run_deg: number | null;
  live_twa_deg: number | null;
  live_mps: number | null;
}

/**
 * The order that stands.
 */
export interface Standing {
  verb: string;
  words: string;
  by: string;
  at_en_m: [number, number] | null;
  age_s: number | null;
}

/**
 * What the boat does and why, in words; ``wants`` is what is missing for it to go on. ``age_s``: since it began.
 */
export interface State {
  phase: string;
  why: string;
  task: string;
  age_s: number | null;
  mode: string | null;
  is_armed: boolean | null;
  is_sailing: boolean | null;
  is_over: boolean | null;
  has_arrived: boolean | null;
  is_planning: boolean | null;
  wants: string[];
}

/**
 * Where the boat was, ``ago_s`` before.
 */
export interface TrackPoint {
  ago_s: number;
  at_en_m: [number, number];
  tack: "port" | "starboard" | null;
}

/**
 * Another vessel and the closest approach to it, hull to hull, if both go on; ``cpa_s`` None: it draws away.
 */
export interface Vessel {
  name: string;
  mmsi: number | null;
  age_s: number | null;
  at_en_m: [number, number] | null;
  course_deg: number | null;
  speed_mps: number | null;
  heading_deg: number | null;
  length_m: number | null;
  beam_m: number | null;
  alarm: string;
  role: string;
  rule: string;
  range_m: number | null;
  bearing_deg: number | null;
  cpa_m: number | null;
  cpa_s: number | null;
  cpa_en_m: [number, number] | null;
  own_cpa_en_m: [number, number] | null;
}

/**
 * Everything at ``t_s`` (the voyage's own clock) and ``unix_s`` [s since 1970]; ``area`` is the hash of its Area.
 *
 *     ``age_s`` is the age of the newest thing heard of the boat, at ``t_s``.
 */
export interface View {
  source: "live" | "radio" | "recorded";
  name: string;
  t_s: number;
  state: State;
  schema: string;
  unix_s: number | null;
  age_s: number | null;
  area: string | null;
  alarms: Alarm[];
  boat: Boat;
  wind: Wind | null;
  water: Water | null;
  no_go: NoGo | null;
  laylines: Laylines | null;
  polar: Polar | null;
  plan: Plan | null;
  predicted: Ahead[];
  track: TrackPoint[];
  vessels: Vessel[];
  goals: Goal[];
  refuges: Place[];
  home: Place | null;
  safe_end: Place | null;
  orders: Orders;
  figures: Figures;
  shown: Figure[];
  health: Part[];
}

/**
 * The current: where it goes and how fast, the standard deviation in its most uncertain direction.
 *
 *     ``is_planned``: it is strong and sure enough for plans to reckon with it; ``verdict`` says what is not known of it.
 *     ``twd_from_deg`` and ``tws_mps`` are the present wind over this water, which is what the boat sails by.
 */
export interface Water {
  set_deg: number;
  drift_mps: number;
  sigma_mps: number | null;
  is_planned: boolean;
  verdict: string;
  twd_from_deg: number | null;
  tws_mps: number | null;
}

/**
 * A waypoint of the passage, the band about the leg to it, and when she is there [s] after the departure.
 */
export interface Waypoint {
  at_en_m: [number, number];
  name: string;
  band_m: number;
  way_m: number;
  early_s: number | null;
  middle_s: number | null;
  late_s: number | null;
}

/**
 * The no-go zone at a horizon: ``half_deg`` to either side of ``from_deg``, ``widening_deg`` of it the spread.
 */
export interface Wedge {
  horizon_s: number;
  from_deg: number;
  half_deg: number;
  widening_deg: number;
}

/**
 * The wind now (5 s mean), its 90 s mean, the forecast's quantiles; angles at the bow are positive to starboard.
 *
 *     ``awa_deg`` and ``aws_mps`` follow from the true wind and the motion over ground. ``health`` is none, settling,
 *     good, light or untrusted, ``verdict`` says why it is not good.
 */
export interface Wind {
  health: string;
  verdict: string;
  twd_from_deg: number | null;
  tws_mps: number | null;
  mean_twd_from_deg: number | null;
  mean_tws_mps: number | null;
  sigma_deg: number | null;
  tws_sigma_mps: number | null;
  twa_deg: number | null;
  awa_deg: number | null;
  aws_mps: number | null;
  record_s: number | null;
  correlation_s: number | null;
  age_s: number | null;
  levels: number[];
  bands: Band[];
}
