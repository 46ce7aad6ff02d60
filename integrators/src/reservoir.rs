//! One of several things, chosen in proportion to their weights as they come.

use sampling::fault;

/// What was chosen of what has come so far \[Chao82\].
#[derive(Clone, Copy, Debug)]
pub struct Reservoir<T> {
    chosen: Option<(T, f32)>,
    /// Sum of all weights.
    sum: f32,
    /// A uniform number, made anew at every choice from what the last one has left of it.
    u: f32,
}

impl<T> Reservoir<T> {
    /// Empty; choices will be made by a uniform number in [0, 1).
    pub fn new(u: f32) -> Self {
        Self { chosen: None, sum: 0.0, u }
    }

    /// Offers a thing of a weight ≥ 0.
    pub fn offer(&mut self, thing: T, weight: f32) {
        // What is no number is chosen, so that it is not lost: it will be counted.
        if weight == 0.0 {
            return;
        }
        self.sum += weight;
        let share = weight / self.sum;
        if self.u < share || share.is_nan() {
            self.u = (self.u / share).min(1.0_f32.next_down());
            self.chosen = Some((thing, weight));
        } else {
            self.u = ((self.u - share) / (1.0 - share)).min(1.0_f32.next_down());
        }
    }

    /// What was chosen, and the inverse of the probability with which it was.
    pub fn take(self) -> Option<(T, f32)> {
        self.chosen.map(|(thing, weight)| (thing, fault!("choice_not_compensated", self.sum / weight, 1.0)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn things_are_chosen_in_proportion_to_their_weights() {
        let weights = [0.5, 0.0, 3.0, 1.5];
        let mut counts = [0.0; 4];
        const N: usize = 10_000;
        for i in 0..N {
            let mut reservoir = Reservoir::new((i as f32 + 0.5) / N as f32);
            weights.into_iter().enumerate().for_each(|(i, w)| reservoir.offer(i, w));
            let (chosen, inverse) = reservoir.take().unwrap();
            assert!((inverse - 5.0 / weights[chosen]).abs() < 1e-5);
            counts[chosen] += 1.0 / N as f32;
        }
        // The numbers are equidistant, and each choice takes an interval of them or two.
        for (count, weight) in counts.into_iter().zip(weights) {
            assert!((count - weight / 5.0).abs() < 1e-3, "{counts:?}");
        }
    }

    #[test]
    fn nothing_comes_of_nothing_and_what_is_no_number_is_kept() {
        let mut reservoir = Reservoir::new(0.5);
        reservoir.offer('a', 0.0);
        assert!(reservoir.take().is_none());
        reservoir.offer('b', 1.0);
        reservoir.offer('c', f32::NAN);
        assert!(reservoir.take().is_some_and(|(thing, inverse)| thing == 'c' && inverse.is_nan()));
    }
}
