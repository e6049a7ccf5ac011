//! Bounded Levenberg-Marquardt, independent problems side by side.
//!
//! [Levenberg1944], [Marquardt1963]; damping scaled by the Hessian's diagonal. Each lane has its own damping and stops on its
//! own; finished lanes keep their point while the others go on, or take the next of a queue of problems.

use crate::lanes::{Isa, LANES, Lane, LaneMask, outlined};
use crate::number::{Mask, Number, Real, array};

/// A cost, half its descent direction and the Gauss-Newton approximation of half its Hessian at a point.
#[derive(Clone, Copy)]
pub struct Quadratic<const ISA: Isa, const P: usize> {
    pub cost: Lane<ISA>,
    /// JᵀW r with r = data − model: minus half the cost's gradient.
    pub descent: [Lane<ISA>; P],
    /// JᵀW J; the upper triangle is used.
    pub hessian: [[Lane<ISA>; P]; P],
}

impl<const ISA: Isa, const P: usize> Quadratic<ISA, P> {
    #[inline(always)]
    pub fn zero() -> Self {
        let zero = Lane::splat(0.0);
        Quadratic { cost: zero, descent: [zero; P], hessian: [[zero; P]; P] }
    }

    #[inline(always)]
    fn select(mask: LaneMask, yes: &Self, no: &Self) -> Self {
        let mut result = *no;
        result.cost = Lane::select(mask, yes.cost, no.cost);
        for i in 0..P {
            result.descent[i] = Lane::select(mask, yes.descent[i], no.descent[i]);
            for j in i..P {
                result.hessian[i][j] = Lane::select(mask, yes.hessian[i][j], no.hessian[i][j]);
            }
        }
        result
    }
}

/// A least-squares problem in P parameters that live on some manifold of points.
pub trait Objective<const ISA: Isa, const P: usize> {
    type Point: Copy;

    fn quadratic(&mut self, point: &Self::Point) -> Quadratic<ISA, P>;
    /// The point reached by a step, moved back inside the bounds.
    fn moved(&self, point: &Self::Point, step: &[Lane<ISA>; P]) -> Self::Point;
    /// Parameters that lie at a bound which `descent` pushes against.
    fn blocked(&self, point: &Self::Point, descent: &[Lane<ISA>; P]) -> [LaneMask; P];
    fn select(mask: LaneMask, yes: &Self::Point, no: &Self::Point) -> Self::Point;
    /// What the damping of each parameter is proportional to: the Hessian's diagonal.
    #[inline(always)]
    fn damping_scale(&self, at: &Quadratic<ISA, P>) -> [Lane<ISA>; P] {
        array!(|i| at.hessian[i][i])
    }
    /// Called with each point the minimiser has settled on so far; the lanes of `mask` have just moved there.
    fn accepted(&mut self, _point: &Self::Point, _mask: LaneMask) {}
}

pub struct Outcome<Point, const ISA: Isa> {
    pub point: Point,
    pub cost: Lane<ISA>,
    /// Lanes whose cost had stopped changing before the steps ran out.
    pub converged: LaneMask,
}

/// Relative change of the cost below which a lane has converged, whichever its sign: in f32 the last step is often rejected
/// by rounding alone.
const TOLERANCE: f64 = 3e-5;

#[inline(always)]
pub fn minimise<const ISA: Isa, const P: usize, O: Objective<ISA, P>>(
    objective: &mut O,
    start: &O::Point,
    wanted: LaneMask,
    max_steps: usize,
) -> Outcome<O::Point, ISA> {
    outlined::<ISA, _>(
        #[inline(always)]
        || minimise_inline(objective, start, wanted, max_steps),
    )
}

#[inline(always)]
fn minimise_inline<const ISA: Isa, const P: usize, O: Objective<ISA, P>>(
    objective: &mut O,
    start: &O::Point,
    wanted: LaneMask,
    max_steps: usize,
) -> Outcome<O::Point, ISA> {
    let mut search = Search::begin(start, wanted);
    // The start itself is the first trial.
    for _ in 0..=max_steps {
        search.step(objective);
        if !search.active.any() {
            break;
        }
    }
    Outcome { point: search.point, cost: search.current.cost, converged: wanted & !search.active }
}

/// Problems that are waiting, of which each lane takes the next when it has done with one.
pub trait Queue<const ISA: Isa, const P: usize>: Objective<ISA, P> {
    /// Makes the next problem that of a lane, and its start the lane's point; false when none is left.
    fn next(&mut self, lane: usize, point: &mut Self::Point) -> bool;
    /// Takes the outcome of the problem that a lane had.
    fn finish(&mut self, lane: usize, outcome: &Outcome<Self::Point, ISA>);
}

/// Minimises every problem of a queue. No lane waits for the slowest of the others, as it does in `minimise`.
#[inline(always)]
pub fn minimise_all<const ISA: Isa, const P: usize, O: Queue<ISA, P>>(
    queue: &mut O,
    anywhere: &O::Point,
    max_steps: usize,
) {
    outlined::<ISA, _>(
        #[inline(always)]
        || minimise_all_inline(queue, anywhere, max_steps),
    )
}

#[inline(always)]
fn minimise_all_inline<const ISA: Isa, const P: usize, O: Queue<ISA, P>>(
    queue: &mut O,
    anywhere: &O::Point,
    max_steps: usize,
) {
    let mut search = Search::begin(anywhere, LaneMask::NONE);
    let mut busy = [false; LANES];
    let mut steps = [0; LANES];
    loop {
        let outcome = Outcome { point: search.point, cost: search.current.cost, converged: !search.active };
        let mut begun = LaneMask::NONE;
        for lane in 0..LANES {
            if search.active.holds(lane) && steps[lane] <= max_steps {
                continue;
            }
            if busy[lane] {
                queue.finish(lane, &outcome);
            }
            busy[lane] = queue.next(lane, &mut search.trial_point);
            search.active.set(lane, busy[lane]);
            begun.set(lane, busy[lane]);
            steps[lane] = 0;
        }
        if !search.active.any() {
            return;
        }
        search.restart::<O>(begun);
        search.step(queue);
        for count in &mut steps {
            *count += 1;
        }
    }
}

/// Where the lanes of a minimisation are.
struct Search<Point, const ISA: Isa, const P: usize> {
    /// The best point so far, and the quadratic there.
    point: Point,
    current: Quadratic<ISA, P>,
    /// The point to look at next.
    trial_point: Point,
    damping: Lane<ISA>,
    active: LaneMask,
}

const FIRST_DAMPING: f64 = 1e-3;
/// Before the first trial, which every lane accepts.
const UNKNOWN_COST: f64 = f32::MAX as f64;

impl<Point: Copy, const ISA: Isa, const P: usize> Search<Point, ISA, P> {
    #[inline(always)]
    fn begin(start: &Point, active: LaneMask) -> Self {
        let mut current = Quadratic::zero();
        current.cost = Lane::splat(UNKNOWN_COST);
        Search { point: *start, current, trial_point: *start, damping: Lane::splat(FIRST_DAMPING), active }
    }

    /// Begins anew in some lanes, from their trial points.
    #[inline(always)]
    fn restart<O: Objective<ISA, P, Point = Point>>(&mut self, lanes: LaneMask) {
        self.point = O::select(lanes, &self.trial_point, &self.point);
        self.current.cost = Lane::select(lanes, Lane::splat(UNKNOWN_COST), self.current.cost);
        self.damping = Lane::select(lanes, Lane::splat(FIRST_DAMPING), self.damping);
    }

    /// Looks at the trial points, and makes the next of those lanes that go on.
    #[inline(always)]
    fn step<O: Objective<ISA, P, Point = Point>>(&mut self, objective: &mut O) {
        let trial = objective.quadratic(&self.trial_point);
        let better = trial.cost.lt(self.current.cost) & self.active;
        let settled = (trial.cost - self.current.cost).abs().lt(self.current.cost * Lane::splat(TOLERANCE));
        let raised = (self.damping * Lane::splat(8.0)).max(Lane::splat(0.1));
        let lowered = (self.damping * Lane::splat(0.1)).max(Lane::splat(1e-7));
        self.damping = Lane::select(better, lowered, raised);

        self.point = O::select(better, &self.trial_point, &self.point);
        self.current = Quadratic::select(better, &trial, &self.current);
        objective.accepted(&self.point, better);
        // Damping beyond this bound means that no step, however short, lowers the cost: a kink or a flat valley.
        let stuck = self.damping.gt(Lane::splat(1e7));
        let blocked = objective.blocked(&self.point, &self.current.descent);
        let step = damped_step(&self.current, self.damping, &objective.damping_scale(&self.current), &blocked);
        // To first order the step lowers the cost by twice this, to second order by this: too little to be worth a look.
        let mut promised = Lane::splat(0.0);
        for i in 0..P {
            promised = step[i].mul_add(self.current.descent[i], promised);
        }
        let vain = promised.lt(self.current.cost * Lane::splat(TOLERANCE));
        self.active = self.active & !(settled | stuck | vain);
        self.trial_point = objective.moved(&self.point, &step);
    }
}

/// Solves (H + damping · diag scale) step = descent by LDLᵀ, with blocked parameters held.
#[inline(always)]
fn damped_step<const ISA: Isa, const P: usize>(
    at: &Quadratic<ISA, P>,
    damping: Lane<ISA>,
    scale: &[Lane<ISA>; P],
    blocked: &[LaneMask; P],
) -> [Lane<ISA>; P] {
    let zero = Lane::splat(0.0);
    let mut matrix = at.hessian;
    let mut right = at.descent;
    for i in 0..P {
        matrix[i][i] = damping.mul_add(scale[i], matrix[i][i]);
        right[i] = Lane::select(blocked[i], zero, right[i]);
        for j in i + 1..P {
            matrix[i][j] = Lane::select(blocked[i] | blocked[j], zero, matrix[i][j]);
        }
    }
    solve_symmetric(matrix, right)
}

/// Solves a symmetric positive semidefinite system given by its upper triangle. A parameter that nothing depends on gets 0.
#[inline(always)]
pub fn solve_symmetric<const ISA: Isa, const P: usize>(
    mut matrix: [[Lane<ISA>; P]; P],
    mut right: [Lane<ISA>; P],
) -> [Lane<ISA>; P] {
    let mut inverse = [Lane::splat(0.0); P];
    for i in 0..P {
        let pivot = matrix[i][i];
        let singular = pivot.lt(Lane::splat(1e-30));
        inverse[i] = Lane::select(singular, Lane::splat(0.0), Lane::splat(1.0) / pivot);
        for j in i + 1..P {
            let factor = matrix[i][j] * inverse[i];
            for k in j..P {
                matrix[j][k] = matrix[j][k] - factor * matrix[i][k];
            }
            right[j] = right[j] - factor * right[i];
        }
    }
    for i in (0..P).rev() {
        let mut sum = right[i];
        for j in i + 1..P {
            sum = sum - matrix[i][j] * right[j];
        }
        right[i] = sum * inverse[i];
    }
    right
}

/// The inverse of a symmetric positive definite matrix given by its upper triangle; rows and columns of parameters that
/// nothing depends on are 0.
#[inline(always)]
pub fn inverse<const ISA: Isa, const P: usize>(matrix: &[[Lane<ISA>; P]; P]) -> [[Lane<ISA>; P]; P] {
    let mut columns = [[Lane::splat(0.0); P]; P];
    for i in 0..P {
        let mut unit = [Lane::splat(0.0); P];
        unit[i] = Lane::splat(1.0);
        columns[i] = solve_symmetric(*matrix, unit);
    }
    columns
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::{LANES, PLAIN};

    struct Rosenbrock {
        lower: f32,
    }

    /// r = (10 (y − x²), 1 − x), written as data − model; x bounded below.
    impl Objective<PLAIN, 2> for Rosenbrock {
        type Point = [Lane<PLAIN>; 2];

        fn quadratic(&mut self, point: &Self::Point) -> Quadratic<PLAIN, 2> {
            let [x, y] = *point;
            let ten = Lane::splat(10.0);
            let first = ten * (y - x * x);
            let second = Lane::splat(1.0) - x;
            let jacobian = [[ten * (x + x), -ten], [Lane::splat(1.0), Lane::splat(0.0)]];
            let residual = [first, second];
            let mut result = Quadratic::zero();
            result.cost = first * first + second * second;
            for (row, r) in jacobian.iter().zip(residual) {
                for i in 0..2 {
                    result.descent[i] = result.descent[i] + row[i] * r;
                    for j in i..2 {
                        result.hessian[i][j] = result.hessian[i][j] + row[i] * row[j];
                    }
                }
            }
            result
        }
        fn moved(&self, point: &Self::Point, step: &[Lane<PLAIN>; 2]) -> Self::Point {
            [(point[0] + step[0]).max(Lane([self.lower; LANES])), point[1] + step[1]]
        }
        fn blocked(&self, point: &Self::Point, descent: &[Lane<PLAIN>; 2]) -> [LaneMask; 2] {
            [LaneMask::new(|i| point[0].0[i] <= self.lower && descent[0].0[i] < 0.0), LaneMask::NONE]
        }
        fn select(mask: LaneMask, yes: &Self::Point, no: &Self::Point) -> Self::Point {
            [Lane::select(mask, yes[0], no[0]), Lane::select(mask, yes[1], no[1])]
        }
    }

    #[test]
    fn finds_the_minimum_of_rosenbrocks_valley_from_many_starts() {
        let x = [-1.2, 0.0, 2.0, -2.0, 0.5, 1.5, -0.5, 3.0];
        let y = [1.0, 0.0, -1.0, 2.0, 0.5, 0.0, 1.0, 1.0];
        let start = [Lane(array!(|i| x[i % 8])), Lane(array!(|i| y[i / 2]))];
        let all = LaneMask::ALL;
        let outcome = minimise(&mut Rosenbrock { lower: -10.0 }, &start, all, 200);
        for i in 0..LANES {
            assert!(outcome.converged.holds(i));
            assert!((outcome.point[0].0[i] - 1.0).abs() < 1e-3 && (outcome.point[1].0[i] - 1.0).abs() < 2e-3);
        }
    }

    #[test]
    fn holds_a_parameter_at_its_bound() {
        let start = [Lane::splat(3.0), Lane::splat(1.0)];
        let outcome = minimise(&mut Rosenbrock { lower: 1.5 }, &start, LaneMask::ALL, 200);
        assert_eq!(outcome.point[0].0[0], 1.5);
        assert!((outcome.point[1].0[0] - 2.25).abs() < 1e-3);
    }

    #[test]
    fn says_so_when_the_steps_run_out() {
        let start = [Lane::splat(-1.2), Lane::splat(1.0)];
        let outcome = minimise(&mut Rosenbrock { lower: -10.0 }, &start, LaneMask::ALL, 2);
        assert!(!outcome.converged.any());
    }
}
