# SPDX-FileCopyrightText: 2026 The fastcal authors
# SPDX-License-Identifier: MIT
"""The rules of the diagnosis: every number that decides an answer, its meaning, unit and origin.

Four currencies: levels (a chance of error, family-wise where a family is tested), BIC (a difference of 10 is odds of
1 : 150), signal-to-noise ratios (root of a chi square) and shares. They are read at call time as `rules.NAME`: a test
changes each in turn (tests/python/diagnosis/rules). Numbers that may be doubled and halved without another answer stand
beside their formula: guards against rounding, limits of effort, lengths of lists.

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
# Change of chi square that decides nothing: a tenth of what chance makes of one number. Numerical.
CHI_SQUARE_TOLERANCE = 0.1

# --- Noise and outliers -----------------------------------------------------------------------------------------------
# Share of the degrees of freedom that the blocks of the rich model may take: more leaves too little to estimate the
# noise from, less takes a missing effect for noise.
RICH_MODEL_SHARE = 0.35
# Chance that noise alone puts one row of a data set on the list of outliers. Level.
ALPHA_OUTLIER = 0.01
# Share of the rows that may be outliers: more are no outliers but an effect.
MAX_OUTLIER_SHARE = 0.05
# Chance that outliers lie so near each other on one joint's way. Level.
ALPHA_POSTURE = 1e-3
# Two-sided level at which a claimed noise, or repeats against the rich model, are taken to be wrong. Level.
ALPHA_NOISE = 0.01
# One-sided level at which rows measured one after the other err alike. Noise that is slow and taken for white makes
# causes; white noise that is taken for slow hides a little of what changes slowly. Level.
ALPHA_MEMORY = 0.01
# BIC by which a motion of base or tool in time must do better than noise with a memory does not to be that noise (odds
# of 1 : 22 000).
SLOW_MOTION_BIC = 20.0
# Correlation of successive rows from which on something slow may hide in the noise, and a verdict says so.
STRONG_MEMORY = 0.5
# Twice the log of the likelihood by which t noise must exceed normal noise for the rows of the written model to be
# weighed: one number more, chosen where there is nothing in one of twenty sets. A wrong choice costs a few percent.
HEAVY_TAILS_GAIN = 2.7

# --- What is tested ---------------------------------------------------------------------------------------------------
# Cycles a turn of the periodic names. Gears, encoders, bearings: others are scanned for.
WAVE_ORDERS = (1, 2, 3, 4, 5, 6)
# Quantiles of a joint's load at which a compliance may begin to bend; the fit goes on from the best.
CORNER_QUANTILES = (0.2, 0.35, 0.5, 0.65, 0.8)
# How late heat may reach the metal [of the time that the data span].
LAG_SHARES = (0.04, 0.1, 0.25)
# Rows on either side of a step at least, as poses that load a joint less, and more, than where a law of its load bends.
MIN_ROWS_BESIDE_STEP = 5
# Degree of curves over time.
TIME_DEGREE = 5

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
# Names that are tried on top of each set that is kept.
CHILDREN_PER_NODE = 4
# Difference of BIC that decides between two sets (odds of 1 : 150).
DECISIVE_BIC = 10.0
# Signal-to-noise ratio of a name beside something that has none: weaker ones may be its shadow.
MIN_SNR_BESIDE_REST = 10.0
# Share of the misfit that names must explain where something remains, to be given.
MIN_EXPLAINED_SHARE = 0.5
# Parts of the data, dealt by pose, of which each is held out once.
FOLDS = 5
# Regions of the workspace that are dealt to the folds, a power of two, and rows that each has at least.
REGIONS, MIN_REGION_ROWS = 32, 3
# Size from which on the loss of a held-out row grows with its size only [typical rows]: squares judge white noise.
LOSS_SIZE = 3.0
# Standard errors by which a name must help to predict held-out rows to be given at all. A signal of s standard
# deviations gains about s / 2 of these, and the best of a hundred names seems to gain 1 where nothing is missing. So
# must what is written lead an arm held near nominal, and a simpler model with its surrogate; and a surrogate that
# changes with time in the last rows, which are few.
MIN_GAIN = 2.0
# The same where an order, a moment or a lag was searched for, or laws of some joints were chosen: the rows held out had
# their say in it. Simulated.
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
# Fits of a rival, each on the rows that the one before reaches, at most. Numerical.
MAX_REFITS = 3

# --- Scans ------------------------------------------------------------------------------------------------------------
# Chance that a scan of all moments, periods and lags comes upon something where nothing is missing. Level.
ALPHA_SCAN = 1e-3
# Time constants of what comes to rest [of the time that the data span].
SETTLING_SHARES = (0.02, 0.04, 0.08, 0.15, 0.3, 0.6)

# --- Waves and curves of joints ---------------------------------------------------------------------------------------
# Level of a wave that a scan of orders finds. Level.
ALPHA_WAVE = 1e-3
# Length scales of a smooth curve over a joint's position [of its range], beside which its waves are weighed.
CURVE_SCALES = (0.07, 0.15, 0.35, 0.8)

# Order of the finest waves that a curve over a joint's position may show: one a motor turn behind a usual reduction.
FINEST_ORDER = 120.0

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
# Chance to take a moved zero of a joint for a motion of base, instrument or target that is more than that. Level.
ALPHA_MOVED_ZERO = 1e-3

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
