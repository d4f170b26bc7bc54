// The rotary arm by hand: the scheme of smajax/simulation/step.py and smajax/simulation/stage_solver.py for one system.
//
// Wire under the `enhanced` law with the rate form (eq. 3.2), arm with end stops, amplified voltage held over the run.
// SI, temperatures in C. A block of members goes through each phase of a stage together: short loops over the lanes that
// a compiler turns into vector instructions, several of them under way at a time. Members that need more iterations than
// the others repeat with their block, and nothing is changed for the lanes that are done.
//
// What differs from the Python program, none of it in the equations:
//   - a transformation is told by what is left of the vanishing phase: p = xi with the amplitude xi_M on heating,
//     p = 1 - xi with 1 - xi_A on cooling. With the distance through the range counted from its start,
//     1 - cos^2(pi z/2) = cos^2(pi (1 - z)/2) makes both branches the same formula, worked out once;
//   - after the first linearisation of a stage one inner step is enough: its start is nearly the solution;
//   - cos^2 and distances of the state before a step are kept, not computed again;
//   - an end stop is recognised by the last linearised equation of motion;
//   - slopes within Newton's method use shorter polynomials than values.
//
// arm PARAMETERS MEMBERS RESULT --dt S --steps N [--threads N] [--precision double|float] [--repeats N]
//     [--record FILE --every K --first M]
// PARAMETERS: lines of `name value`. MEMBERS: float64 (voltage, payload_mass) a member. RESULT: float64 (final angle,
// largest angle, smallest fraction, final temperature) a member. The record: float64 (angle, fraction) of the first M
// members at every K-th sample, the first included. Printed as JSON: the seconds of the best repeat.

#include <omp.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#ifndef LANES
#define LANES 64
#endif
#define INLINE static inline __attribute__((always_inline))

constexpr double PI = 3.14159265358979323846;
constexpr double GRAVITY = 9.81;
// The second linearisation starts so near that one inner step leaves nothing for a third.
constexpr int QUICK = 2, INNER = 3, INNER_LATER = 1;
constexpr int MOST_QUICK = 6, MOST_ITERATIONS = 50, UNDAMPED = 12, MOST_HALVINGS = 80;
constexpr double TOLERANCE = 1e-4, FINISHED = 1e-9, NARROWEST_RANGE = 0.05;
constexpr int COLUMNS = 4;

using Parameters = std::map<std::string, double>;

// smajax/model/wire/cosine.py; terms below the rounding of single precision are left out there.
constexpr double C[8] = {-1.2337005501361697,     0.253669507901046,     -0.02086348076331063,
                         0.0009192602745006437,   -2.5202041041025108e-05, 4.710846321668482e-07,
                         -6.3832315751919636e-09, 6.357424822347121e-11};

// cos(pi z/2) for |z| <= 1, its terms paired: a shorter chain of dependent instructions than Horner's.
template <class Real> INLINE Real quarter_cosine(Real z) {
    const Real s = z * z, s2 = s * s;
    const Real first = (Real(C[0]) + Real(C[1]) * s) + (Real(C[2]) + Real(C[3]) * s) * s2;
    Real last = Real(C[4]) + Real(C[5]) * s;
    if constexpr (sizeof(Real) == 8) last += (Real(C[6]) + Real(C[7]) * s) * s2;
    return Real(1) + s * (first + last * (s2 * s2));
}

// d/dz of it over z to 2e-06: the slope in Newton's method needs no more.
template <class Real> INLINE Real quarter_cosine_slope(Real s) {
    return (Real(-2.467399217797122) + Real(1.0146177496075262) * s) +
           (Real(-0.1248783185922484) + Real(0.006865300346788672) * s) * (s * s);
}

template <class Real> INLINE Real within(Real value, Real low, Real high) {
    const Real floored = value < low ? low : value;
    return floored > high ? high : floored;
}

// Share of the vanishing phase left at the distance z through its range: 1 up to 0, 0 from 1 on.
template <class Real> INLINE Real share_left(Real z) {
    const Real root = quarter_cosine(within(z, Real(0), Real(1)));
    const Real share = root * root;
    return share > Real(FINISHED) ? share : Real(0);
}

// What all members share.
template <class Real> struct Rig {
    Real step, per_step, ahead;              // g = gamma dt, 1/g, (1 - gamma) dt / g
    Real keeps, ambient;                     // 1/(1 + g h_c A_c/(m c_p)), and what the air adds to a temperature
    Real ohms, ohms_more;                    // per metre, of austenite and from there to martensite
    Real modulus, modulus_more;              // of austenite and from there to martensite
    Real recoverable, thermal, contraction;  // eps_L, theta_T, strain per angle
    Real start, rest_angle, lower, upper;
    Real per_width_A, per_width_M, per_slope_A, per_slope_M;  // of the ranges, and of both in stress: 1/(width slope)
    Real start_A, start_M;                                    // A_s and M_s over the widths
    Real tolerance, angle_scale, resting;
    Real initial_temperature, initial_fraction;
    // Of one member, with the lever, the inertia and g^2 put in later.
    double heat_in, lever_area, stiffness, damping, arm_length, link_mass, inertia_ratio, limit, gain_per_metre;
};

template <class Real> Rig<Real> rig_of(const Parameters& p, double dt) {
    const auto at = [&p](const char* name) {
        const auto found = p.find(name);
        if (found == p.end()) throw std::runtime_error(std::string("no parameter ") + name);
        return found->second;
    };
    Rig<Real> r;
    const double gamma = 1.0 - std::sqrt(0.5), g = gamma * dt;
    const double area = 0.25 * PI * at("wire_diameter") * at("wire_diameter");
    const double capacity = at("density") * area * at("specific_heat");
    const double loss = g * at("convection_coefficient") * PI * at("wire_diameter") / capacity;
    r.step = g, r.per_step = 1.0 / g, r.ahead = (1.0 - gamma) / gamma;
    r.keeps = 1.0 / (1.0 + loss), r.ambient = loss / (1.0 + loss) * at("ambient_temperature");
    r.heat_in = g / capacity / (1.0 + loss);
    r.ohms = at("resistivity_austenite") / area;
    r.ohms_more = (at("resistivity_martensite") - at("resistivity_austenite")) / area;
    r.modulus = at("young_modulus_austenite");
    r.modulus_more = at("young_modulus_martensite") - at("young_modulus_austenite");
    r.recoverable = at("recoverable_strain"), r.thermal = at("thermal_modulus");
    const double contraction = 2.0 * at("pulley_radius") / at("wire_length");
    r.contraction = contraction;
    r.start = at("start_angle"), r.rest_angle = at("spring_rest_angle");
    r.lower = at("lower_stop"), r.upper = at("upper_stop");
    const double width_A = std::max(at("austenite_finish") - at("austenite_start"), NARROWEST_RANGE);
    const double width_M = std::max(at("martensite_start") - at("martensite_finish"), NARROWEST_RANGE);
    // The cooling range of the Python program begins `width` above M_f, which is M_s but where the range is too narrow.
    r.per_width_A = 1.0 / width_A, r.per_width_M = 1.0 / width_M;
    r.per_slope_A = 1.0 / (width_A * at("stress_slope_austenite"));
    r.per_slope_M = 1.0 / (width_M * at("stress_slope_martensite"));
    r.start_A = at("austenite_start") / width_A, r.start_M = (at("martensite_finish") + width_M) / width_M;
    const double rounding = std::numeric_limits<Real>::epsilon();
    r.tolerance = std::max(TOLERANCE, 1e3 * rounding);
    r.angle_scale = 100.0 * contraction;
    r.resting = std::max(1e-10, 64.0 * rounding);
    r.initial_temperature = at("ambient_temperature"), r.initial_fraction = at("start_fraction");
    r.lever_area = 2.0 * at("pulley_radius") * area;
    r.stiffness = at("spring_stiffness") * at("spring_lever") * at("spring_lever");
    r.damping = at("damping"), r.arm_length = at("arm_length"), r.link_mass = at("link_mass");
    r.inertia_ratio = at("inertia_ratio");
    r.limit = at("amplifier_limit") / at("wire_length"), r.gain_per_metre = at("amplifier_gain") / at("wire_length");
    return r;
}

// A block of members: every array holds one number a member.
template <class Real> struct alignas(64) Block {
    using Lane = Real[LANES];
    // Of the member: what power, gravity, spring, damping and stress add to the equations, by g and the inertia.
    Lane heating, gravity, spring, damping, pull;
    // State: own strain of the wire, amplitudes xi_M and 1 - xi_A, distances through the ranges and shares left there.
    Lane temperature, angle, velocity, stress, strain, fraction;
    Lane amplitude_A, amplitude_M, missed_A, missed_M, distance_A, distance_M, share_A, share_M;
    Lane largest_angle, smallest_fraction;
    // Base values of the stage.
    Lane base_temperature, base_angle, base_velocity;
    // Unknowns of the stage. branch: 1 heating, -1 cooling, 0 neither. enough: 1 where the last step hardly moved.
    Lane z_temperature, z_angle, z_stress, z_fraction, z_free, branch, enough;
    // Steps towards the solution at the present fraction, and more for one unit of it.
    Lane cosine, sine;
    Lane step_temperature, more_temperature, step_angle, more_angle, step_stress, more_stress, free, more_free;
    // The kinetics as one equation of what vanishes: phase, amplitude of its curve, distance and its slope, what has gone.
    Lane chosen, phase, amplitude, distance, slope, gone, gone_last;
};

// Phase 0: cosine and sine of the angle, a phase of its own so that several vectors are under way.
template <class Real> INLINE void turn(Block<Real>& b, int i) {
    const Real x = b.z_angle[i];
    const Real turns = x * Real(1 / PI), whole = std::rint(turns);
    const Real sign = Real(1) - Real(2) * (whole - Real(2) * std::floor(Real(0.5) * whole));
    const Real z = Real(2) * (turns - whole);
    b.cosine[i] = sign * quarter_cosine(z);
    b.sine[i] = sign * (Real(-2 / PI) * z * quarter_cosine_slope(z * z));
}

// Phase 1: heat, motion and stress linearised at the unknowns, solved as straight lines over the fraction.
template <bool FIRST, class Real> INLINE void linearise(Block<Real>& b, const Rig<Real>& r, int i) {
    const Real xi = b.z_fraction[i], x = b.z_angle[i], sigma = b.z_stress[i];

    const Real cosine = b.cosine[i], sine = b.sine[i];
    const Real moved = x - b.base_angle[i];
    const Real miss = moved * (Real(1) + b.damping[i]) - r.step * b.base_velocity[i] + b.gravity[i] * cosine +
                      b.spring[i] * (x - r.rest_angle) - b.pull[i] * sigma;
    const Real by_angle = Real(1) + b.damping[i] + b.spring[i] - b.gravity[i] * sine;
    const Real free = x - miss;
    const bool below = free < r.lower, above = free > r.upper, stopped = below | above;
    const Real missed = below ? x - r.lower : (above ? x - r.upper : miss);
    const Real by_angle_held = stopped ? Real(1) : by_angle, pull_held = stopped ? Real(0) : b.pull[i];

    // The unknowns start from the state before the stage.
    const Real grown = FIRST ? Real(0) : xi - b.fraction[i];
    const Real warmer = FIRST ? Real(0) : b.z_temperature[i] - b.temperature[i];
    const Real modulus = r.modulus + r.modulus_more * (FIRST ? xi : b.fraction[i] + Real(0.5) * grown);
    const Real elastic = -r.contraction * (x - r.start) - b.strain[i] - r.recoverable * grown;
    const Real asked = modulus * elastic + b.stress[i] + r.thermal * warmer;
    const Real taut = asked > Real(0) ? Real(1) : Real(0);  // a number: the compiler would make jumps of a truth value
    const Real by_temperature = taut * r.thermal, stiffness = taut * (modulus * r.contraction);
    const Real by_fraction = taut * (Real(0.5) * r.modulus_more * elastic - modulus * r.recoverable);
    const Real over = taut * asked - sigma;

    // 1/R and 1/determinant by one division.
    const Real ohms = r.ohms + r.ohms_more * xi;
    const Real determinant = by_angle_held + pull_held * stiffness;
    const Real both = Real(1) / (ohms * determinant);
    const Real per_ohm = both * determinant, per_determinant = both * ohms;

    const Real heated = b.heating[i] * per_ohm;
    const Real more_temperature = -heated * per_ohm * r.ohms_more;
    const Real step_temperature = heated + r.keeps * b.base_temperature[i] + r.ambient - b.z_temperature[i];
    const Real right = over + by_temperature * step_temperature;
    const Real right_more = by_fraction + by_temperature * more_temperature;
    const Real step_stress = (by_angle_held * right + stiffness * missed) * per_determinant;
    const Real more_stress = by_angle_held * right_more * per_determinant;
    const Real step_angle = (pull_held * right - missed) * per_determinant;
    const Real more_angle = pull_held * right_more * per_determinant;

    b.step_temperature[i] = step_temperature, b.more_temperature[i] = more_temperature;
    b.step_angle[i] = step_angle, b.more_angle[i] = more_angle;
    b.step_stress[i] = step_stress, b.more_stress[i] = more_stress;
    if constexpr (!FIRST) {  // where the arm would be without stops
        b.free[i] = free + step_angle - by_angle * step_angle + b.pull[i] * step_stress;
        b.more_free[i] = more_angle - by_angle * more_angle + b.pull[i] * more_stress;
    }
}

// Phase 2: the branch, tried with the fraction frozen, and the equation of the kinetics on it.
template <bool FIRST, class Real> INLINE void decide(Block<Real>& b, const Rig<Real>& r, int i) {
    const Real xi = b.fraction[i], back = FIRST ? Real(0) : xi - b.z_fraction[i];
    const Real temperature = b.z_temperature[i] + b.step_temperature[i] + b.more_temperature[i] * back;
    const Real stress = b.z_stress[i] + b.step_stress[i] + b.more_stress[i] * back;
    const Real distance_A = temperature * r.per_width_A - stress * r.per_slope_A - r.start_A;
    const Real distance_M = r.start_M - temperature * r.per_width_M + stress * r.per_slope_M;
    const Real gap_A = xi - b.amplitude_A[i] * share_left(distance_A);
    const Real gap_M = Real(1) - xi - b.amplitude_M[i] * share_left(distance_M);
    const bool heats = (gap_A > r.resting) & (distance_A > b.distance_A[i]) & (b.share_A[i] > Real(0));
    const bool cools = (gap_M > r.resting) & (distance_M > b.distance_M[i]) & (b.share_M[i] > Real(0));
    // How far each curve lies beyond the present fraction, where it may be followed; the farther one is.
    const Real loss = heats ? gap_A : Real(0), gain = cools ? gap_M : Real(0);
    const Real cooling = gain > loss ? Real(1) : Real(0);
    const Real heating = std::max(loss, gain) > Real(0) ? Real(1) - cooling : Real(0);

    const Real slope_A = b.more_stress[i] * r.per_slope_A - b.more_temperature[i] * r.per_width_A;
    const Real slope_M = b.more_stress[i] * r.per_slope_M - b.more_temperature[i] * r.per_width_M;
    const bool of_cooling = cooling > Real(0);
    const Real distance = of_cooling ? distance_M : distance_A, slope = of_cooling ? slope_M : slope_A;
    const Real phase = heating * xi + cooling * (Real(1) - xi);
    b.chosen[i] = heating - cooling, b.phase[i] = phase;
    b.amplitude[i] = heating * b.amplitude_A[i] + cooling * b.amplitude_M[i];
    b.distance[i] = distance, b.slope[i] = slope;
    Real gone = (heating - cooling) * back;
    if constexpr (FIRST) {
        // As far as the driving temperature stays: on a fast way that holds far better than the fraction.
        const Real before = of_cooling ? b.distance_M[i] : b.distance_A[i];
        const Real falling = slope < Real(0) ? slope : Real(-1);
        const Real ratio = (before - distance) / falling;
        gone = slope < Real(0) ? ratio : Real(0);
    }
    b.gone[i] = within(gone, Real(0), phase);
}

// (miss, slope) of the kinetics where `gone` of the vanishing phase has gone.
template <class Real> struct Line {
    Real value, slope;
};
template <class Real> INLINE Line<Real> kinetics(const Block<Real>& b, int i, Real gone) {
    const Real z = within(b.distance[i] + b.slope[i] * gone, Real(0), Real(1));
    const Real root = quarter_cosine(z), share = root * root;
    const Real kept = share > Real(FINISHED) ? share : Real(0);
    const Real slope = Real(1) + Real(2) * b.amplitude[i] * b.slope[i] * root * z * quarter_cosine_slope(z * z);
    return {gone - b.phase[i] + b.amplitude[i] * kept, slope};
}

// Phase 3: one of Newton's steps on that equation.
template <class Real> INLINE void newton(Block<Real>& b, int i) {
    const Line<Real> at = kinetics(b, i, b.gone[i]);
    const Real gone = within(b.gone[i] - at.value / at.slope, Real(0), b.phase[i]);
    b.gone_last[i] = std::abs(gone - b.gone[i]), b.gone[i] = gone;
}

// The same to the end within its bracket: of one member, where the steps above were not enough.
template <class Real> void bisect(Block<Real>& b, int i) {
    Real low = 0, high = b.phase[i], gone = b.gone[i], change = 1;
    const Real enough = 4 * std::numeric_limits<Real>::epsilon();
    for (int step = 0; step < MOST_HALVINGS && change > enough; ++step) {
        const Line<Real> at = kinetics(b, i, gone);
        if (at.value < 0) low = gone;
        if (at.value > 0) high = gone;
        const Real free = gone - at.value / at.slope;
        const bool inside = free > low && free < high && step % 3 != 2;
        const Real next = at.value == 0 ? gone : (inside ? free : Real(0.5) * (low + high));
        change = std::abs(next - gone), gone = next;
    }
    b.gone[i] = gone, b.gone_last[i] = 0;
}

// Phase 4: the unknowns moved.
template <class Real> struct Change {
    Real temperature, angle, stress, fraction;
};
template <class Real> INLINE Change<Real> change(const Block<Real>& b, int i) {
    const Real moved = b.fraction[i] - b.chosen[i] * b.gone[i] - b.z_fraction[i];
    return {b.step_temperature[i] + b.more_temperature[i] * moved, b.step_angle[i] + b.more_angle[i] * moved,
            b.step_stress[i] + b.more_stress[i] * moved, moved};
}
template <class Real> INLINE void advance_first(Block<Real>& b, int i) {
    const Change<Real> by = change(b, i);
    b.z_temperature[i] += by.temperature, b.z_angle[i] += by.angle, b.z_stress[i] += by.stress;
    b.z_fraction[i] += by.fraction, b.branch[i] = b.chosen[i];
}
// Of the lanes that are not done, if some are; and whether that was the last of it.
template <bool AGAIN, class Real> INLINE void advance(Block<Real>& b, const Rig<Real>& r, int i, Real share) {
    const Change<Real> by = change(b, i);
    const Real largest = std::max(std::max(std::abs(by.temperature), std::abs(by.angle) * r.angle_scale),
                                  std::abs(by.fraction));
    const Real modulus = Real(1e-4) * (r.modulus + r.modulus_more * b.fraction[i]);
    const bool still = (share * largest + b.gone_last[i] <= r.tolerance) &
                       (share * std::abs(by.stress) <= r.tolerance * modulus);
    const Real enough = still & (b.chosen[i] == b.branch[i]) ? Real(1) : Real(0);
    const Real moves = AGAIN ? share * (Real(1) - b.enough[i]) : share;
    const Real free = b.free[i] + b.more_free[i] * by.fraction;
    b.z_temperature[i] += moves * by.temperature, b.z_angle[i] += moves * by.angle;
    b.z_stress[i] += moves * by.stress, b.z_fraction[i] += moves * by.fraction;
    b.z_free[i] = AGAIN && !(moves > Real(0)) ? b.z_free[i] : free;
    b.branch[i] = AGAIN && !(moves > Real(0)) ? b.branch[i] : b.chosen[i];
    b.enough[i] = AGAIN ? std::max(enough, b.enough[i]) : enough;
}

// Phase 5: how far through the ranges the stage ended.
template <class Real> INLINE void locate(Block<Real>& b, const Rig<Real>& r, int i) {
    const Real temperature = b.z_temperature[i], stress = std::max(b.z_stress[i], Real(0));
    const Real distance_A = temperature * r.per_width_A - stress * r.per_slope_A - r.start_A;
    const Real distance_M = r.start_M - temperature * r.per_width_M + stress * r.per_slope_M;
    b.distance_A[i] = distance_A, b.distance_M[i] = distance_M;
    b.share_A[i] = share_left(distance_A), b.share_M[i] = share_left(distance_M);
}

// Phase 6: the state at the end of the stage, what the kinetics remembers, and the base of the next stage.
template <bool LAST, class Real> INLINE void finish(Block<Real>& b, const Rig<Real>& r, int i) {
    // Numbers in the place of truth values: of a longer expression of those the compiler makes jumps, and no vectors.
    const Real heating = std::max(b.branch[i], Real(0)), cooling = std::max(-b.branch[i], Real(0));
    const Real held = Real(1) - heating - cooling;
    const Real ended = within(b.z_fraction[i], Real(0), Real(1)), xi = held > Real(0) ? b.fraction[i] : ended;
    const Real temperature = b.z_temperature[i], stress = std::max(b.z_stress[i], Real(0));
    const Real grown = xi - b.fraction[i];
    const Real modulus = r.modulus + r.modulus_more * (b.fraction[i] + Real(0.5) * grown);

    const Real share_A = b.share_A[i], share_M = b.share_M[i];
    const Real some_A = std::max(share_A, Real(FINISHED)), some_M = std::max(share_M, Real(FINISHED));
    // Three reciprocals by one division.
    const Real shares = some_A * some_M, all = Real(1) / (shares * modulus), per_shares = all * modulus;
    const Real laid_A = xi * (per_shares * some_M), laid_M = (Real(1) - xi) * (per_shares * some_A);

    const Real elastic = stress - b.stress[i] - r.thermal * (temperature - b.temperature[i]);
    b.strain[i] = b.strain[i] + r.recoverable * grown + elastic * (all * shares);
    const Real beyond_A = xi - b.amplitude_A[i] * share_A > r.resting ? Real(1) - heating : Real(0);
    const Real beyond_M = Real(1) - xi - b.amplitude_M[i] * share_M > r.resting ? Real(1) - cooling : Real(0);
    const Real missed_A = held * std::max(beyond_A, b.missed_A[i]), missed_M = held * std::max(beyond_M, b.missed_M[i]);
    b.amplitude_A[i] = cooling + beyond_A + missed_A > Real(0) ? laid_A : b.amplitude_A[i];
    b.amplitude_M[i] = heating + beyond_M + missed_M > Real(0) ? laid_M : b.amplitude_M[i];
    b.missed_A[i] = missed_A, b.missed_M[i] = missed_M;

    const bool below = b.z_free[i] < r.lower, above = b.z_free[i] > r.upper, stopped = below | above;
    const Real angle = below ? r.lower : (above ? r.upper : b.z_angle[i]);
    const Real moves = stopped ? Real(0) : Real(1);
    const Real velocity = moves * ((angle - b.base_angle[i]) * r.per_step);
    b.temperature[i] = temperature, b.stress[i] = stress, b.fraction[i] = xi;
    b.angle[i] = angle, b.velocity[i] = velocity;
    if constexpr (LAST) {
        b.base_temperature[i] = temperature, b.base_angle[i] = angle, b.base_velocity[i] = velocity;
        b.largest_angle[i] = std::max(b.largest_angle[i], angle);
        b.smallest_fraction[i] = std::min(b.smallest_fraction[i], xi);
    } else {
        b.base_temperature[i] += r.ahead * (temperature - b.base_temperature[i]);
        b.base_angle[i] += r.ahead * r.step * velocity;
        b.base_velocity[i] += moves * (r.ahead * (velocity - b.base_velocity[i]));
    }
    b.z_temperature[i] = temperature, b.z_angle[i] = angle, b.z_stress[i] = stress, b.z_fraction[i] = xi;
    b.branch[i] = 0;
}

#define OVER_LANES _Pragma("omp simd") for (int i = 0; i < LANES; ++i)

template <bool FIRST, class Real> __attribute__((noinline)) void all_linearise(Block<Real>& b, const Rig<Real>& r) {
    OVER_LANES linearise<FIRST>(b, r, i);
}
template <class Real> __attribute__((noinline)) void all_turn(Block<Real>& b) {
    OVER_LANES turn(b, i);
}
template <bool FIRST, class Real> __attribute__((noinline)) void all_decide(Block<Real>& b, const Rig<Real>& r) {
    OVER_LANES decide<FIRST>(b, r, i);
}
template <class Real> __attribute__((noinline)) void all_newton(Block<Real>& b) {
    OVER_LANES newton(b, i);
}
template <class Real> void all_inner(Block<Real>& b, int steps) {
    for (int step = 0; step < steps; ++step) all_newton(b);
}
template <class Real> __attribute__((noinline)) void all_advance_first(Block<Real>& b) {
    OVER_LANES advance_first(b, i);
}
template <bool AGAIN, class Real> __attribute__((noinline)) void all_advance(Block<Real>& b, const Rig<Real>& r) {
    OVER_LANES advance<AGAIN>(b, r, i, Real(1));
}
template <class Real> __attribute__((noinline)) void all_locate(Block<Real>& b, const Rig<Real>& r) {
    OVER_LANES locate(b, r, i);
}
template <bool LAST, class Real> __attribute__((noinline)) void all_finish(Block<Real>& b, const Rig<Real>& r) {
    OVER_LANES finish<LAST>(b, r, i);
}

template <class Real> void all_again(Block<Real>& b, const Rig<Real>& r) {
    all_turn(b), all_linearise<false>(b, r), all_decide<false>(b, r), all_inner(b, INNER_LATER);
}

template <class Real> bool finished(const Block<Real>& b) {
    Real count = 0;
#pragma omp simd reduction(+ : count)
    for (int i = 0; i < LANES; ++i) count += b.enough[i];
    return count == Real(LANES);
}

// One stage; returns the iterations that its block needed.
template <bool LAST, class Real> int stage(Block<Real>& b, const Rig<Real>& r) {
    all_turn(b), all_linearise<true>(b, r), all_decide<true>(b, r), all_inner(b, INNER), all_advance_first(b);
    int iterations = 1;
    for (; iterations < QUICK; ++iterations) all_again(b, r), all_advance<false>(b, r);
    for (; iterations < MOST_QUICK && !finished(b); ++iterations) all_again(b, r), all_advance<true>(b, r);
    if (iterations == MOST_QUICK && !finished(b)) {
        for (int i = 0; i < LANES; ++i)
            for (int k = iterations; k < MOST_ITERATIONS && !(b.enough[i] > 0); ++k) {
                turn(b, i), linearise<false>(b, r, i), decide<false>(b, r, i), bisect(b, i);
                advance<false>(b, r, i, k > UNDAMPED && k % 2 == 0 ? Real(0.5) : Real(1));
            }
    }
    all_locate(b, r), all_finish<LAST>(b, r);
    return iterations;
}

// At rest in equilibrium at ambient temperature (smajax/model/system.py).
template <class Real> void start(Block<Real>& b, const Rig<Real>& r, int i, double voltage, double payload) {
    const double step = r.step, inertia = r.inertia_ratio * (payload + r.link_mass / 3.0) * r.arm_length * r.arm_length;
    const double by_inertia = step * step / inertia, put = std::min(std::abs(r.gain_per_metre * voltage), r.limit);
    const double weight = (payload + 0.5 * r.link_mass) * GRAVITY * r.arm_length;
    b.heating[i] = r.heat_in * put * put;
    b.gravity[i] = by_inertia * weight, b.spring[i] = by_inertia * r.stiffness;
    b.damping[i] = by_inertia * r.damping / step, b.pull[i] = by_inertia * r.lever_area;

    const double x = r.start, resisting = weight * std::cos(x) + r.stiffness * (x - double(r.rest_angle));
    const Real xi = r.initial_fraction, temperature = r.initial_temperature;
    const Real stress = std::max(resisting / r.lever_area, 0.0);
    b.temperature[i] = temperature, b.angle[i] = x, b.velocity[i] = 0, b.stress[i] = stress, b.strain[i] = 0;
    b.fraction[i] = xi;
    b.distance_A[i] = temperature * r.per_width_A - stress * r.per_slope_A - r.start_A;
    b.distance_M[i] = r.start_M - temperature * r.per_width_M + stress * r.per_slope_M;
    b.share_A[i] = share_left(b.distance_A[i]), b.share_M[i] = share_left(b.distance_M[i]);
    b.amplitude_A[i] = xi / std::max(b.share_A[i], Real(FINISHED));
    b.amplitude_M[i] = xi >= 1 ? Real(1) : (Real(1) - xi) / std::max(b.share_M[i], Real(FINISHED));
    b.missed_A[i] = b.share_A[i] <= Real(FINISHED) && xi > 0, b.missed_M[i] = b.share_M[i] <= Real(FINISHED) && xi < 1;
    b.largest_angle[i] = x, b.smallest_fraction[i] = xi;
    b.base_temperature[i] = b.z_temperature[i] = temperature, b.base_angle[i] = b.z_angle[i] = x;
    b.base_velocity[i] = 0, b.z_stress[i] = stress, b.z_fraction[i] = xi, b.branch[i] = 0, b.enough[i] = 0;
}

struct Task {
    std::vector<double> members, result, record;
    double dt = 0;
    long steps = 0, every = 1, first = 0;
    int threads = 1, repeats = 1;
    long stages = 0, iterations = 0;  // of blocks
    double seconds = std::numeric_limits<double>::infinity(), processor_seconds = seconds;  // of the best repeat
};

template <class Real> void simulate(Task& task, const Parameters& parameters) {
    const Rig<Real> rig = rig_of<Real>(parameters, task.dt);
    const long count = long(task.members.size() / 2), blocks = (count + LANES - 1) / LANES;
    for (int repeat = 0; repeat < task.repeats; ++repeat) {
        const auto begin = std::chrono::steady_clock::now();
        const std::clock_t begin_processor = std::clock();
        long iterations = 0;
#pragma omp parallel for schedule(dynamic) num_threads(task.threads) reduction(+ : iterations)
        for (long block = 0; block < blocks; ++block) {
            Block<Real> b;
            const auto member = [&](int i) { return std::min(block * LANES + i, count - 1); };  // the last one fills up
            for (int i = 0; i < LANES; ++i)
                start(b, rig, i, task.members[2 * member(i)], task.members[2 * member(i) + 1]);
            const long recorded = std::min<long>(task.first - block * LANES, LANES);
            const auto record = [&](long step) {
                for (int i = 0; i < recorded; ++i) {
                    double* at = &task.record[2 * (step / task.every * task.first + block * LANES + i)];
                    at[0] = b.angle[i], at[1] = b.fraction[i];
                }
            };
            if (recorded > 0) record(0);
            for (long step = 1; step <= task.steps; ++step) {
                iterations += stage<false>(b, rig);
                iterations += stage<true>(b, rig);
                if (recorded > 0 && step % task.every == 0) record(step);
            }
            for (int i = 0; i < LANES && block * LANES + i < count; ++i) {
                double* at = &task.result[COLUMNS * (block * LANES + i)];
                at[0] = b.angle[i], at[1] = b.largest_angle[i];
                at[2] = b.smallest_fraction[i], at[3] = b.temperature[i];
            }
        }
        const double processor = double(std::clock() - begin_processor) / CLOCKS_PER_SEC;
        const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
        task.seconds = std::min(task.seconds, seconds);
        task.processor_seconds = std::min(task.processor_seconds, processor);
        task.stages = 2 * task.steps * blocks, task.iterations = iterations;
    }
}

std::vector<double> read_numbers(const std::string& path) {
    std::ifstream file(path, std::ios::binary | std::ios::ate);
    if (!file) throw std::runtime_error("cannot read " + path);
    std::vector<double> numbers(size_t(file.tellg()) / sizeof(double));
    file.seekg(0);
    file.read(reinterpret_cast<char*>(numbers.data()), std::streamsize(numbers.size() * sizeof(double)));
    return numbers;
}

void write_numbers(const std::string& path, const std::vector<double>& numbers) {
    std::ofstream file(path, std::ios::binary);
    file.write(reinterpret_cast<const char*>(numbers.data()), std::streamsize(numbers.size() * sizeof(double)));
    if (!file) throw std::runtime_error("cannot write " + path);
}

int run(int count, char** words) {
    if (count < 4 || count % 2 != 0) throw std::runtime_error("arm PARAMETERS MEMBERS RESULT --name value ...");
    std::map<std::string, std::string> options{{"--threads", "1"}, {"--precision", "double"}, {"--repeats", "1"},
                                               {"--record", ""},   {"--every", "1"},          {"--first", "0"}};
    for (int i = 4; i < count; i += 2) options[words[i]] = words[i + 1];
    Parameters parameters;
    std::ifstream file(words[1]);
    std::string name;
    for (double value; file >> name >> value;) parameters[name] = value;
    Task task;
    task.members = read_numbers(words[2]);
    task.dt = std::stod(options["--dt"]), task.steps = std::stol(options["--steps"]);
    task.threads = std::stoi(options["--threads"]), task.repeats = std::stoi(options["--repeats"]);
    task.every = std::stol(options["--every"]);
    const long members = long(task.members.size() / 2);
    task.first = options["--record"].empty() ? 0 : std::min(std::stol(options["--first"]), members);
    task.result.resize(COLUMNS * members);
    task.record.resize(2 * (task.steps / task.every + 1) * task.first);
    const bool single = options["--precision"] == "float";
    single ? simulate<float>(task, parameters) : simulate<double>(task, parameters);
    write_numbers(words[3], task.result);
    if (!options["--record"].empty()) write_numbers(options["--record"], task.record);
    std::printf("{\"seconds\": %.9g, \"processor_seconds\": %.9g, \"lanes\": %d, \"iterations_per_stage\": %.6g}\n",
                task.seconds, task.processor_seconds, LANES, double(task.iterations) / std::max(task.stages, 1L));
    return 0;
}

int main(int count, char** words) {
    try {
        return run(count, words);
    } catch (const std::exception& error) {
        std::fprintf(stderr, "arm: %s\n", error.what());
        return 1;
    }
}
