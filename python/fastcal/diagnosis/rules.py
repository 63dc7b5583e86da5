# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The rules of the diagnosis: every number on which an answer depends, its meaning, unit and origin.

Four currencies: levels (a chance of error, family-wise where a family is tested), BIC (a difference of 10 is odds of
1 : 150), signal-to-noise ratios (root of a chi square) and shares. They are read at call time as `rules.NAME`: a test
changes each in turn (tests/python/diagnosis/rules). Guards against rounding in one formula stay beside it.

Where they come from: "Level" is a chance that was chosen; "Numerical" is accuracy beyond which answers do not change;
"Simulated" was set on the sets of bench/python/diagnosis_sets.py, whose outcome docs/diagnosis-performance.md holds;
where nothing is said, it was chosen by what its comment says and is held by that outcome alone.
"""

# --- Fits -------------------------------------------------------------------------------------------------------------
# Standard deviation of the prior that every parameter has about its start [plausible sizes]: wide enough to
# decide nothing that the data show, and the same in fits and tests along directions that they do not show.
PRIOR_WIDTH = 30.0
# The same of the arm's angles and of curves of its joints, at most, unless the arm is farther off [rad; of lengths, of
# the reach]: what the rows hardly show stays near nominal, as `calibrate` holds it.
GEOMETRY_WIDTH = 5e-3
# Longest reach of a step along what the data hardly show [plausible sizes]. Numerical.
MAX_STEP = 30.0
# Linearizations of a fit at most. Numerical.
MAX_ITERATIONS = 15
# Change of chi square that decides nothing, and the same as a share of chi square. Numerical.
CHI_SQUARE_TOLERANCE, CHI_SQUARE_SHARE = 0.1, 1e-5
# Share of the misfit that a parameter of its usual size must move to have an influence at all. Numerical.
MIN_INFLUENCE = 1e-9
# Largest plausible size of a length or an angle of the geometry [1 mm, 1 mrad]: beyond, the tool moves along a curve.
MAX_GEOMETRY_SIZE = 30.0

# --- Noise and outliers -----------------------------------------------------------------------------------------------
# Common noise to begin with where the data claim none [m, rad]; it is estimated from there on.
NOISE_GUESS = 1e-4
# Share of the degrees of freedom that the blocks of the rich model may take: more leaves too little to estimate the
# noise from, less takes a missing effect for noise.
RICH_MODEL_SHARE = 0.35
# Columns of these blocks at most, as many as a thousand numbers have: more cost time and show no more.
RICH_MODEL_COLUMNS = 350
# Blocks that enter the rich model first at most, and the gain of BIC that each must bring (odds of 1 : 22 000).
MAX_CLEAR_BLOCKS, CLEAR_BLOCK_BIC = 12, 20.0
# Chance that noise alone puts one row of a data set on the list of outliers. Level.
ALPHA_OUTLIER = 0.01
# Share of the rows that may be outliers: more are no outliers but an effect.
MAX_OUTLIER_SHARE = 0.05
# Rows, one measured after the other, that are no outliers if all of them are off: of 5 % outliers so many come in a row
# in one of a thousand sets.
OUTLIER_RUN = 4
# Chance that outliers lie so near each other on one joint's way. Level.
ALPHA_POSTURE = 1e-3
# Two-sided level at which a claimed noise, or repeats against the rich model, are taken to be wrong. Level.
ALPHA_NOISE = 0.01
# One-sided level at which rows measured one after the other err alike. Noise that is slow and taken for white makes
# causes; white noise that is taken for slow hides a little of what changes slowly. Level.
ALPHA_MEMORY = 0.01
# Successive poses nearer than this share of the distance of poses half the set apart are a path, as a grid is measured:
# what is missing is alike in successive rows too, and only plain correlation counts as memory. Share.
NEAR_STEPS = 0.6
# BIC by which a motion of base or tool in time must do better than noise with a memory does not to be that noise (odds
# of 1 : 22 000), and share of the rows that may lie off together and be left out.
SLOW_MOTION_BIC, MAX_MOVED_SHARE = 20.0, 0.35
# Rows of one command are repeats of each other if their temperatures agree within [K].
REPEAT_TEMPERATURE = 0.5
# Share of the square of what rows are off by that their mean makes, from which on they lie off together: where they
# scatter it is one over their number.
TOGETHER = 0.5
# Correlation of successive rows from which on something slow may hide in the noise, and a verdict says so.
STRONG_MEMORY = 0.5
# Degrees of freedom from which on repeats determine the noise (sigma within 13 %).
MIN_REPEAT_FREEDOM = 30
# The noise of one kind of observation beside another's is found when it moves by less than this share, or after so many
# rounds: where one is far finer than it was taken for, each round brings it half way. Numerical.
SCALE_CHANGE, SCALE_ROUNDS = 0.03, 12
# Rounds of reweighting and of rejecting rows, each. Numerical.
NOISE_ROUNDS = 6
# Size of a row from which on Huber's and Tukey's weights fall [medians of a row].
HUBER_SIZE, TUKEY_SIZE = 1.5, 5.0
# Twice the log of the likelihood by which t noise must exceed normal noise for the rows of the written model to be
# weighed: one number more, chosen where there is nothing in one of twenty sets. A wrong choice costs a few percent.
HEAVY_TAILS_GAIN = 2.7
# Weight below which a row is a suspect.
SUSPECT_WEIGHT = 0.05
# Least share of a number that the other rows leave to chance (its redundancy): below, it is fitted whatever it is.
MIN_REDUNDANCY = 0.05
# Ridge on unit columns of the rich model, which may be dependent. Numerical.
RIDGE = 1e-9
# Share of the variance below which the noise was taken too large and the search begins again.
RESTART_BELOW = 0.85
# Searches with a new noise or new waves at most.
MAX_SEARCHES = 3

# --- What is tested ---------------------------------------------------------------------------------------------------
# Cycles a turn of the periodic names. Gears, encoders, bearings: others are scanned for.
WAVE_ORDERS = (1, 2, 3, 4, 5, 6)
# Quantiles of a joint's load at which a compliance may begin to bend; the fit goes on from the best.
CORNER_QUANTILES = (0.2, 0.35, 0.5, 0.65, 0.8)
# How late heat may reach the metal [of the time that the data span].
LAG_SHARES = (0.04, 0.1, 0.25)
# Moments of a step that are tried before the best is searched for, and rows on either side of it at least, as poses
# that load a joint less, and more, than where a law of its load bends.
STEP_MOMENTS, MIN_ROWS_BESIDE_STEP = 24, 5
# Fourier orders of a curve over a turn, and degree of a curve over a load.
CURVE_ORDERS = 6
# Degrees of curves over time, temperature, and any other condition (an own column, the payload).
TIME_DEGREE, TEMPERATURE_DEGREE, CONDITION_DEGREE = 5, 3, 2
# Links that carry nearly all of an arm's weight, the longest: where they reach, a base that yields leans to.
LONG_LINKS = 2
# Degree of a smooth field over the workspace.
FIELD_DEGREE = 3
# Orders of an instrument's circles, and degree of its range.
CIRCLE_ORDERS, RANGE_DEGREE = 2, 2
# Distance from the instrument's own axis below which a point has no azimuth [of the farthest].
MIN_AXIS_DISTANCE = 1e-2
# Singular value below which a combination of curves is none of its own over these rows [of the largest].
MIN_CURVE_VALUE = 1e-2

# --- Search -----------------------------------------------------------------------------------------------------------
# Chance to see something where nothing is missing, names and blocks without a name together. Level.
ALPHA_DETECT = 0.005
# Chance to see one more where the set in the model is all there is. Level.
ALPHA_FURTHER = 0.002
# Chance to refuse a true name beside the best since another name, or a block without a name, is significant by chance.
# Levels: together one of 25.
ALPHA_NAMED, ALPHA_GENERIC = 0.03, 0.01
# Effects of a set that is searched for over all sizes, and of one that grows on, its members exchanged on the way.
MAX_EFFECTS, MAX_EFFECTS_GROWN = 4, 8
# Sets of one size that are kept, names that are tried on top of each, and in place of each member of one that grows on.
BEAM_WIDTH, CHILDREN_PER_NODE, EXCHANGES_PER_MEMBER = 3, 4, 2
# Measured numbers that names are searched for in, 6,000 rows of positions or 3,000 of poses; where there are more, what
# was found is fitted to all of them. An effect of which these show nothing (SNR 6) moves the tool by less than a
# twentieth of the noise. A limit of memory: columns of all that an arm of six joints may lack take 180 MB.
SEARCHED_NUMBERS = 18000
# Numbers of Jacobians (measured numbers times parameters) that the fits of one search may evaluate before it tries no
# larger sets and no further exchanges: 1,500 linearizations of 300 points with 75 parameters. A limit of effort:
# simulated sets of 300 rows took 0.3 to 25 % of it.
MAX_WORK = 1e8
# Difference of BIC that decides between two sets (odds of 1 : 150).
DECISIVE_BIC = 10.0
# Signal-to-noise ratio of a name beside something that has none: weaker ones may be its shadow.
MIN_SNR_BESIDE_REST = 10.0
# Share of the misfit that names must explain where something remains, to be given.
MIN_EXPLAINED_SHARE = 0.5
# Names that are tried in place of each member of the set that is given.
REPLACEMENTS_PER_MEMBER = 8
# Share of a member's chi square that a replacement must explain by its score test to be tried.
REPLACEMENT_SHARE = 0.5
# Parts of the data, dealt by pose, of which each is held out once.
FOLDS = 5
# Parts of a joint's range that are held out as one, where what errs by its position is judged: rows near each other
# share what is wrong with them, and many more would leave neighbours of each.
POSITION_BINS = 40
# Regions of the workspace that are dealt to the folds, a power of two, and rows that each has at least.
REGIONS, MIN_REGION_ROWS = 32, 3
# Size from which on the loss of a held-out row grows with its size only [typical rows]: squares judge white noise.
LOSS_SIZE = 3.0
# Standard errors by which a name must help to predict held-out rows to be given at all. A signal of s standard
# deviations gains about s / 2 of these, and the best of a hundred names seems to gain 1 where nothing is missing. So
# must laws of some joints in place of what was found, and a simpler model with its surrogate; and a surrogate that
# changes with time in the last rows, which are few.
MIN_GAIN = 2.0
# The same where an order, a moment or a lag was searched for: the rows held out had their say in it. Simulated.
MIN_SEARCHED_GAIN = 3.0
# Level, family-wise, below which something is no chance of noise that is not white: MIN_RIVAL_GAIN does for it, since
# what shows in a few rows only, such as a step after five of them, never gains many standard errors. A name
# that is not below it is given but not written: chance makes 1 of 200 sets of names, and such models are worse. Level.
ALPHA_CERTAIN = 1e-5
# Standard errors by which a rival must predict held-out rows better to take the place of a set, and by which a curve
# beside others must help.
MIN_RIVAL_GAIN = 1.0
# Share of what held-out rows are off by, squared, that a model which anyone would try must take of it to be written in
# place of what was found: half of what a user would notice.
MIN_PLAIN_SHARE = 0.03
# RMS error of the written model over that of the geometry alone, from which on it rises.
MAX_RISE = 1.01
# Standard errors by which rows left out must lie nearer with what has no name (curves, surrogates, joints that merely
# yield), chosen without them: it is picked out of hundreds, and its form is wrong. In the eight sets of seeds 9109 to
# 9111 that curves or yielding joints had made 1.7 to 8 % worse they led by 2.3 at most. What changes with time or
# temperature must lead so in the last rows, fitted to those before. Simulated.
UNNAMED_LEAD = 3.0
# Rows up to which the curves' smoothness is chosen again without each fold: of more, a fold hardly changes it.
CHOSEN_AGAIN_ROWS = 400
# Size of a row that a fit has not seen, from which on it is wrong whatever is missing [typical rows]: no fit holds it.
GROSS_SIZE = 10.0
# Share of the misfit that the most names leave, by their score tests, from which on no set is searched for: too little
# explained to be given, with a margin for what fits add to score tests.
HOPELESS_SHARE = 0.6
# Fits of a rival, each on the rows that the one before reaches, at most. Numerical.
MAX_REFITS = 3

# --- Scans ------------------------------------------------------------------------------------------------------------
# Chance that a scan of all moments, periods and lags comes upon something where nothing is missing. Level.
ALPHA_SCAN = 1e-3
# Names that a scan may add, and share of the likeliest one's worth that each must have: the others are its shadows.
SCANNED_NAMES, SCANNED_SHARE = 8, 0.5
# Share of a step (of its variance) that positions, payload, stations and mounts of the rows may explain: where they
# change with it, it is no step in time.
MAX_STEP_SHARE = 0.5
# Waves of an instrument's range over the distances that were measured, at most.
RANGE_CYCLES = 60.0
# Time constants of what comes to rest [of the time that the data span].
SETTLING_SHARES = (0.02, 0.04, 0.08, 0.15, 0.3, 0.6)

# --- Waves and curves of joints ---------------------------------------------------------------------------------------
# Highest order of which each is scored [cycles a turn], and the highest that is looked for, by the periodogram: motor
# turns behind usual reductions, interpolation of encoders.
MAX_ORDER, FINEST_WAVE = 40.0, 400.0
# Peaks of the scan that are taken from each joint, and their level.
PEAKS_PER_JOINT, ALPHA_WAVE = 3, 1e-3
# An order this near to a whole one is whole, and any other unless it explains so much more chi square.
WHOLE_ORDER_WITHIN, BROKEN_ORDER_GAIN = 0.15, 6.0
# Orders that are tried from one step of the scan before a peak to one behind it. Numerical.
ORDERS_OF_A_STEP = 41
# Waves of a model that errs by many.
MAX_WAVES = 24
# Share of the mean square of held-out rows that many waves may leave to be the cause.
MAX_WAVES_SHARE = 0.5
# Length scales of a smooth curve over a joint's position [of its range], beside which its waves are weighed.
CURVE_SCALES = (0.07, 0.15, 0.35, 0.8)

# Order of the finest waves that a curve over a joint's position may show: one a motor turn behind a usual reduction;
# its knots over those of the coarser curve, from which on it is tried; parts of an interval between knots, of which on
# average one must hold rows; measured numbers a knot at least; knots of all curves at most (a file holds
# their covariance).
FINEST_ORDER, FINER, PLACES_PER_KNOT, NUMBERS_PER_KNOT, MAX_KNOTS = 120.0, 1.25, 4, 4, 850

# --- Grades -----------------------------------------------------------------------------------------------------------
# Signal-to-noise ratio of grade A: from here on a look-alike of correlation 0.95 would have shown itself. Simulated.
GRADE_A_SNR = 15.0
# The same of what follows loads: neighbouring joints, bearings and links have correlations up to 0.993. Simulated.
GRADE_A_SNR_LOADS = 40.0
# The same of what changes with time or temperature: an arm warms up while time goes on; a drift, a step and heat that
# lags have correlations up to 0.99. Simulated.
GRADE_A_SNR_SLOW = 40.0
# Signal-to-noise ratio of grade B, and the ratio of two from which on the weaker may make up for the form of the
# stronger one: then, beside something that remains, and among several that change with time or temperature, the signal
# of grade A is asked for. Gauntlet seeds 70001, 81233, 81234: 9 of 47 names wrong without, 0 of them with it.
GRADE_B_SNR, MUCH_STRONGER = 8.0, 2.0
# Largest size of grade A, and of an effect that could have been noticed [plausible sizes]: what is larger does the
# work of something else.
MAX_PLAUSIBLE_SIZE = 30.0
# Standard errors by which held-out rows must be predicted better for grade A.
GRADE_A_GAIN = 2.0
# Noise over what is claimed of it, from which on nothing is sure: the claim is too small, or something remains.
MAX_OVER_CLAIM = 1.2
# Share of the folds without which the same name must come first for grade A, and for grade B. Gauntlet seeds 95501 to
# 95516: without the second, 6 of 62 names of grade B were wrong, four of them first in no fold or in one.
GRADE_A_STABILITY, GRADE_B_STABILITY = 0.8, 0.5
# Names that may come first in a part of the data: those of the largest statistics in all of them.
MAX_CONTENDERS = 12
# Share of a signature from which on a block without a name holds it, and is no other shape.
SAME_SHAPE = 0.98
# Chi square by which a wave of any other order must fit worse for grade A, up to FINEST_ORDER: five standard
# deviations, as CONTRAST. Over a grid of positions other orders are the same wave, to the last digit.
OTHER_ORDER_LOSS = 25.0
# Chance to take a moved zero of a joint for a motion of base, instrument or target that is more than that. Level.
ALPHA_MOVED_ZERO = 1e-3
# Standard deviations by which two parameters must differ for what sets a name apart from a simpler one.
CONTRAST = 5.0

# --- Columns under suspicion ------------------------------------------------------------------------------------------
# Standard deviations of chi square that noise may leave beyond its degrees of freedom with another reading of a column,
# and share of what the plain names leave beyond theirs that it may leave at most.
READING_DEVIATIONS, READING_SHARE = 5.0, 0.5
# Different payloads up to which two may be exchanged, or one may not be carried: of many some pair fits by chance.
MAX_PAYLOADS = 4
# Share of the rows that one payload must have, and leave, to be judged by the others, and share of a mean square below
# which one is clearly less.
MIN_PAYLOAD_SHARE, CLEARLY_LESS = 0.15, 0.8
# Shares by which a load may fall from the first row to the last: what is emptied or used up on the way.
LOAD_FALLS = (0.25, 0.5, 0.75, 1.0)

# --- Cameras and boards -----------------------------------------------------------------------------------------------
# Chance that the best of all causes of a rig gains so much by noise alone. Level.
ALPHA_RIG = 1e-4
# Twice the log of the likelihood by which a cause must lead every other, and every effect of the arm, each above what
# its numbers gain by chance, to be the only one (odds of 1 : 150), and by which further numbers of a cause must help.
RIG_LEAD = 10.0

# --- What remains, what could have been seen, what to measure next ----------------------------------------------------
# Orders that are looked for in a joint's curve, and the share of its square from which on one is stated.
PROFILE_ORDERS, MAIN_ORDER_SHARE = 6, 0.25
# Evidence of a surrogate of what remains, and of a further one [twice a log of likelihoods]; with the next rule none on
# 14 of 14 sets where nothing is missing. Simulated.
SURROGATE_EVIDENCE, FURTHER_SURROGATE_EVIDENCE = 60.0, 30.0
# RMS of poses left out with the surrogates over that without, from which on none is added.
SURROGATE_HELD_OUT = 0.95
# Share of the noise that a model with a surrogate must leave of rows held out to be compared: less is no prediction,
# but squares of large errors, linearized at two fits. Where it was real it left 1.18 or more, in nine sets.
MIN_LEFT = 0.5
# Surrogates at most.
MAX_SURROGATES = 3
# Waves that the sentence lists one by one.
MAX_WAVES_LISTED = 4
# Probability with which the smallest effect that could have been seen is seen.
DETECTION_POWER = 0.8
# Names in the ranking, and in the map of confusions.
RANKING_LENGTH, CONFUSION_LENGTH = 12, 8
# Correlation of two signatures from which on poses confuse them.
CONFUSED_CORRELATION = 0.95
# Poses of a plan at most, and the power at which it asks for no more; below the other power it says so.
PLAN_POSES, PLAN_POWER, MIN_PLAN_POWER = 12, 0.99, 0.8
# Random postures and levels of payload that a plan chooses from.
PLAN_CANDIDATES, PLAN_PAYLOADS = 600, 3

# --- Pictures ---------------------------------------------------------------------------------------------------------
# Leverage of a pose below which it shows next to nothing of an effect [of the 90th percentile].
MIN_LEVERAGE = 0.25
