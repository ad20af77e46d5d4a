// The state machine of automaton.py on boost::odeint: Dormand-Prince 5 with dense output, events located by bisection.
//
//   odeint END TOLERANCE LAW p0 p1 ... < nothing > times of all events, one a line
//   odeint --time ...   prints the seconds of the run and the number of events instead
//
// With -DREAL=boost::multiprecision::float128 it is the reference of the other solvers.

#include <algorithm>
#include <array>
#include <boost/numeric/odeint.hpp>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <vector>

#ifdef QUADRUPLE
#include <boost/multiprecision/float128.hpp>
using Real = boost::multiprecision::float128;
#else
using Real = double;
#endif

using std::abs, std::cos, std::exp, std::sin;
using State = std::array<Real, 2>;

enum Law { STATIC_KINETIC, RATIONAL, TWO_BRANCHES };
enum Branch { FALL, UPPER, COMMON, LOWER, CLIMB, STEEP };

struct Parameters {
    Real damping, drive, amplitude, frequency;
    int law;
    std::array<Real, 14> q;  // STATIC_KINETIC: break-away, kinetic; RATIONAL: break-away, weakening; else as below
    Real initial() const { return q[0]; }
    Real limit() const { return q[1]; }
    Real rate() const { return q[2]; }
    Real force_rate_scale() const { return q[3]; }
    Real upper_slope() const { return q[4]; }
    Real common_slope() const { return q[5]; }
    Real steepest() const { return q[6]; }
    Real b_w() const { return q[7]; }
    Real b_f() const { return q[8]; }
    Real d_w() const { return q[9]; }
    Real d_f() const { return q[10]; }
    Real l_slope() const { return q[11]; }
    Real l_f() const { return q[12]; }
    Real beta() const { return q[13]; }
};

struct Contact {
    const Parameters& p;
    int direction = 0, branch = FALL, rising = 1;
    Real offset = 0, slope = 0, low = 0, high = 0, corner_w = 0, corner_f = 0, anchor_w = 0, anchor_f = 0;
    Real released = -1, since = 0;

    Real holding(Real t, Real x) const { return x + p.damping * p.drive - p.amplitude * cos(p.frequency * t); }

    Real break_away(Real t) const {
        if (p.law != TWO_BRANCHES) return p.q[0];
        Real rate = abs(p.drive + p.amplitude * p.frequency * sin(p.frequency * t));
        return p.initial() + p.limit() * (1 - exp(-p.rate() * (t - since))) / (1 + rate / p.force_rate_scale());
    }

    Real friction(Real u) const { return p.law == RATIONAL ? p.q[0] / (1 + p.q[1] * u) : Real(offset + slope * u); }

    Real acceleration(Real t, Real x, Real v) const {
        if (direction == 0) return 0;
        Real force = direction * friction(direction * (p.drive - v)) - p.damping * v - x;
        return p.amplitude != 0 ? Real(force + p.amplitude * cos(p.frequency * t)) : force;
    }

    void operator()(const State& y, State& dy, Real t) const {
        dy[0] = direction == 0 ? p.drive : y[1];
        dy[1] = acceleration(t, y[0], y[1]);
    }

    std::array<Real, 3> guards(Real t, const State& y) const {
        if (direction == 0) return {break_away(t) - abs(holding(t, y[0])), 1, 1};
        Real u = direction * (p.drive - y[1]);
        if (p.law != TWO_BRANCHES) return {u, 1, 1};
        return {u - low, high - u, -rising * direction * acceleration(t, y[0], y[1])};
    }

    void line(Real w, Real f, Real slope_, Real low_, Real high_, Branch branch_) {
        offset = f - slope_ * w, slope = slope_, low = low_, high = high_, branch = branch_;
    }

    void anchor(Real w, Real f) {
        anchor_w = w, anchor_f = f;
        Real corner = (f - p.upper_slope() * w - p.l_f()) / (p.l_slope() - p.upper_slope());
        corner_w = corner > w ? corner : w;
        corner_f = corner > w ? Real(p.l_slope() * corner + p.l_f()) : f;
    }

    void common() { line(corner_w, corner_f, p.common_slope(), corner_w, 1e300, COMMON); }

    void upper(Real u) {
        if (released >= 0 && u < anchor_w)
            line(0, released, (anchor_f - released) / anchor_w, 0, anchor_w, FALL);
        else if (u < corner_w)
            line(anchor_w, anchor_f, p.upper_slope(), 0, corner_w, UPPER);
        else
            common();
    }

    void lower() { line(corner_w, corner_f, (corner_f - p.b_f()) / (corner_w - p.b_w()), 0, corner_w, LOWER); }

    void leave(Real force, int direction_) {
        direction = direction_, rising = 1;
        if (p.law != TWO_BRANCHES) return line(0, p.q[1], 0, 0, 1e300, FALL);
        anchor(p.beta(), force);
        released = force;
        upper(0);
    }

    void turn(Real u) {
        rising = -rising;
        Real f = friction(u);
        if (rising < 0 && (branch == FALL || branch == UPPER)) {
            Real lower_slope = (corner_f - p.b_f()) / (corner_w - p.b_w());
            Real at = (f - p.steepest() * u - (corner_f - lower_slope * corner_w)) / (lower_slope - p.steepest());
            line(u, f, p.steepest(), at > 0 ? at : Real(0), u, STEEP);
        } else if (rising > 0 && (branch == LOWER || branch == COMMON) && f < p.initial()) {
            Real climb = p.steepest();
            if (u < p.d_w() && f < p.d_f()) climb = std::min(Real((p.d_f() - f) / (p.d_w() - u)), climb);
            line(u, f, climb, u, u + (p.initial() - f) / climb, CLIMB);
        }
    }

    void inner(int guard, Real u) {
        if (guard == 2) {
            turn(u);
        } else if (guard == 1 && branch == CLIMB) {
            Real top = high;
            anchor(top, p.initial());
            released = -1;
            upper(top);
        } else if (guard == 1) {
            upper(high);
        } else if (branch == CLIMB && u > corner_w) {
            common();
        } else {
            lower();
        }
    }

    void follow(int guard, Real t, State& y) {
        if (direction == 0) {
            leave(break_away(t), holding(t, y[0]) < 0 ? -1 : 1);
        } else if (guard > 0 || (p.law == TWO_BRANCHES && low > 0)) {
            return inner(guard, direction * (p.drive - y[1]));
        } else {
            since = t;
            Real need = holding(t, y[0]), bears = break_away(t);
            if (abs(need) <= bears)
                direction = 0;
            else
                leave(bears, need < 0 ? -1 : 1);
        }
        y[1] = p.drive;
    }
};

static std::vector<Real> event_times(const Parameters& p, Real end, Real tolerance) {
    namespace ode = boost::numeric::odeint;
#ifdef QUADRUPLE
    // Order eight with a fixed step; a sixteenth of it where a guard is near zero, so that it cannot dip below unseen.
    using Stepper = ode::runge_kutta_fehlberg78<State, Real>;
    Stepper stepper;
    Contact contact{p};
    State y{0, p.drive};
    Real t = 0;
    std::vector<Real> times;
    auto before = contact.guards(t, y);
    while (t < end) {
        Real h = *std::min_element(before.begin(), before.end()) < tolerance ? tolerance / 16 : tolerance;
        State next = y;
        stepper.do_step(contact, next, t, h);
        auto after = contact.guards(t + h, next);
        int first = -1;
        Real length = 2 * h;
        for (int g = 0; g < 3; ++g) {
            if (!(before[g] > 0 && after[g] <= 0)) continue;
            Real low = 0, high = h, g_low = before[g], g_high = after[g];
            for (int i = 0; i < 200 && high - low > 1e-30; ++i) {
                Real middle = i % 3 == 2 ? Real((low + high) / 2) : Real(high - g_high * (high - low) / (g_high - g_low));
                State trial = y;
                stepper.do_step(contact, trial, t, middle);
                Real value = contact.guards(t + middle, trial)[g];
                if (value <= 0) high = middle, g_high = value; else low = middle, g_low = value;
                if (abs(value) < 1e-31) { high = middle; break; }
            }
            if (high < length) length = high, first = g;
        }
        if (first < 0) {
            y = next, t += h, before = after;
            continue;
        }
        stepper.do_step(contact, y, t, length);
        t += length;
        times.push_back(t);
        contact.follow(first, t, y);
        before = contact.guards(t, y);
    }
    while (!times.empty() && times.back() > end) times.pop_back();
    return times;
#else
    const double largest = 2 * M_PI / 40 / std::max(1.0, p.amplitude != 0 ? p.frequency : 0.0);
    auto stepper = ode::make_dense_output(1e-2 * tolerance, tolerance, largest, ode::runge_kutta_dopri5<State>());
    Contact contact{p};
    State y{0, p.drive};
    double t = 0;
    std::vector<double> times;
    while (t < end) {
        stepper.initialize(y, t, std::min(1e-2, largest));
        auto before = contact.guards(t, y);
        int first = -1;
        while (first < 0 && stepper.current_time() < end) {
            auto [from, to] = stepper.do_step(std::ref(contact));
            auto after = contact.guards(to, stepper.current_state());
            double at = to;
            for (int g = 0; g < 3; ++g) {
                if (!(before[g] > 0 && after[g] <= 0)) continue;
                double low = from, high = to;
                State trial;
                while (high - low > 4e-16 * high) {
                    double middle = 0.5 * (low + high);
                    if (middle == low || middle == high) break;
                    stepper.calc_state(middle, trial);
                    (contact.guards(middle, trial)[g] <= 0 ? high : low) = middle;
                }
                if (first < 0 || high < at) at = high, first = g;
            }
            if (first >= 0) stepper.calc_state(at, y);
            t = at;
            before = after;
        }
        if (first < 0) break;
        times.push_back(t);
        contact.follow(first, t, y);
    }
    while (!times.empty() && times.back() > end) times.pop_back();
    return times;
#endif
}

int main(int argc, char** argv) {
    bool timed = argc > 1 && !std::strcmp(argv[1], "--time");
    char** given = argv + 1 + timed;
    if (argc - timed < 9) return std::fprintf(stderr, "odeint [--time] END TOLERANCE p...\n"), 2;
    auto number = [&](int i) { return std::strtod(given[i], nullptr); };
    Parameters p{number(2), number(3), number(4), number(5), int(number(6)), {}};
    for (int i = 0; 7 + i < argc - 1 - timed && i < 14; ++i) p.q[i] = number(7 + i);
    auto begin = std::chrono::steady_clock::now();
    auto times = event_times(p, number(0), number(1));
    std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - begin;
    if (timed) return std::printf("%.9f %zu\n", seconds.count(), times.size()), 0;
    for (Real t : times) std::printf("%.17g\n", double(t));
}
