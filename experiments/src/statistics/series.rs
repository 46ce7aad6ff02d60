//! How the orders of a Neumann series fall, and what is left beyond the last that was measured.
//!
//! Eigenvalues of `T` come in pairs ±λ where light goes to and fro between two sets of surfaces, as between parallel plates, so that
//! successive orders need not fall by a constant factor while every second one does: the spectral radius is told by `√(P_{k+2} / P_k)`,
//! and the tail by pairs of orders.
//!
//! Intervals are the jackknife's \[Tukey 1958; Efron & Tibshirani 1993, ch. 11\] with Student's quantile over replicates, each of which holds
//! all orders, so that their covariances are taken care of. That of a tail is widened by what the factor may still change: it is taken to go
//! on changing by steps that fall as the last two did, up to ten times as far as the last, or, where the last is within its noise or
//! noisier orders follow, by one more. Where these follow they bring a second interval, which the first is joined to: what is beyond if they
//! go on falling as the later half of them did, or as those before, whichever is slower. A mode that falls slowly and is too weak to have shown itself yet is
//! in no such interval.

use super::Estimate;
use super::means::{self, student};
use sampling::moments::Moments;

/// Replicates from which on the intervals of ratios are valid.
const VALID_FROM: usize = 8;
/// The part of a factor that its 95 % interval may reach to either side, where it is told well.
const TOLD_WELL: f64 = 0.1;
/// The lowest order that tells how others fall: there are three pairs up to it.
const FIRST_TELLER: usize = 5;
/// The relative standard errors that the factor of a pair of orders may have to be told: the first, if any has it.
const SURE: [f64; 2] = [0.005, 0.05];

/// A quantity of every order, such as a flux, in independent replicates.
#[derive(Clone, Debug)]
pub struct Series {
    /// `[replicate][order][channel]`.
    replicates: Vec<Vec<[f64; 3]>>,
}

/// How much is left of the light of an order two orders later, as the square root: an estimate of the spectral radius.
#[derive(Clone, Copy, Debug)]
pub struct Radius {
    /// The first of the two orders.
    pub order: usize,
    /// The channel, the one in which it is largest.
    pub channel: usize,
    /// `√(P_{k+2} / P_k)`.
    pub estimate: Estimate,
}

impl Series {
    /// Of at least two replicates with the same orders.
    pub fn new(replicates: Vec<Vec<[f64; 3]>>) -> Self {
        Self { replicates }
    }

    /// The last order measured.
    pub fn last(&self) -> usize {
        self.replicates.first().map_or(0, |orders| orders.len().saturating_sub(1))
    }

    /// An order, mean of channels.
    pub fn power(&self, order: usize) -> Estimate {
        let values: Vec<f64> = self.replicates.iter().map(|orders| mean_of(orders[order])).collect();
        means::mean(&values)
    }

    /// The next order over this one, means of channels; `None` where this one is 0.
    pub fn ratio(&self, order: usize) -> Option<Estimate> {
        self.jackknife(|orders| positive(mean_of(orders[order + 1]), mean_of(orders[order])))
    }

    /// `√(P_{k+2} / P_k)` of a channel; `None` where the order is 0.
    pub fn root(&self, order: usize, channel: usize) -> Option<Estimate> {
        self.jackknife(|orders| positive(orders[order + 2][channel], orders[order][channel]).map(f64::sqrt))
    }

    /// The root of the channel in which it is largest.
    pub fn largest_root(&self, order: usize) -> Option<Radius> {
        let of = |channel| Some(Radius { order, channel, estimate: self.root(order, channel)? });
        (0..3).filter_map(of).max_by(|a, b| a.estimate.value.total_cmp(&b.estimate.value))
    }

    /// What is known of the spectral radius: the root at the highest order that tells it well, or at the one that tells it best. It grows
    /// towards the radius with the order, and the interval is of its noise alone. `None` where nothing is scattered twice.
    pub fn radius(&self) -> Option<Radius> {
        let error = |radius: &Radius| match radius.estimate.interval {
            Some((low, high)) if radius.estimate.value > 0.0 => (high - low) / (4.0 * radius.estimate.value),
            _ => f64::INFINITY,
        };
        let all: Vec<Radius> =
            (0..self.last().saturating_sub(1)).filter_map(|order| self.largest_root(order)).collect();
        let last = |most: f64| all.iter().rev().find(|radius| error(radius) <= most);
        let best = || all.iter().min_by(|a, b| error(a).total_cmp(&error(b)));
        SURE.into_iter().find_map(last).or_else(best).copied()
    }

    /// The light beyond an order, mean of channels, up to the last order measured and, as geometric series of pairs of orders, beyond
    /// that: `(P_{L−1} + P_L) q^{m+1} / (1 − q)` with `q = (P_{L−1} + P_L) / (P_{L−3} + P_{L−2})`, channel by channel, where L is the highest
    /// order up to the last, K, at which q is told well, and m = ⌊(K − L) / 2⌋ pairs lie between; less order L + 2m + 1, which is
    /// `P_{L−1} q^{m+1}`, where that is K. `None` where orders do not fall, are too noisy or too few.
    pub fn beyond(&self, order: usize) -> Option<Estimate> {
        self.beyond_by(order, self.teller()?)
    }

    /// The same, with the order L.
    fn beyond_by(&self, order: usize, teller: usize) -> Option<Estimate> {
        let measured = |orders: &[[f64; 3]]| Some(orders.get(order + 1..)?.iter().map(|p| mean_of(*p)).sum::<f64>());
        let whole = self.jackknife(|orders| Some(measured(orders)? + tail(orders, teller, 0.0, false)?))?;
        // What it would be if the factor went on changing as it did, or back.
        // Orders that follow would show steps that go on for long, however noisy they are.
        let (mean, goes_on) = (self.mean(None), teller == self.last() && self.is_changing(teller));
        let around = [-1.0, 1.0].map(|sign| Some(measured(&mean)? + tail(&mean, teller, sign, goes_on)?));
        let reach = |side: Option<f64>| side.map_or(f64::INFINITY, |side| (side - whole.value).abs());
        let change = reach(around[0]).max(reach(around[1]));
        let widened = whole.interval.map(|(low, high)| (low - change, high + change));
        let interval = match (teller < self.last(), widened) {
            (true, Some((low, high))) => self
                .jackknife(|orders| Some(measured(orders)? + tail_of_last(orders, teller)?))
                .and_then(|by_last| by_last.interval)
                .map(|by_last| (low.min(by_last.0), high.max(by_last.1))),
            (_, widened) => widened,
        };
        Some(Estimate { interval: interval.filter(|(_, high)| high.is_finite()), ..whole })
    }

    /// The order whose pairs tell how orders beyond the last fall: the highest that tells it well, or the one that has least noise. Where
    /// orders end, which no replicate doubts, it is the last.
    fn teller(&self) -> Option<usize> {
        let is_lit = |orders: &&Vec<[f64; 3]>, order: usize| orders[order] != [0.0; 3];
        let lit = |order: usize| self.replicates.iter().filter(|orders| is_lit(orders, order)).count();
        let end = (0..=self.last()).rev().find(|&order| lit(order) > 0);
        if end.is_none_or(|end| end + 2 <= self.last() && lit(end) == self.replicates.len()) {
            return Some(self.last());
        }
        let pair = |orders: &[[f64; 3]], order: usize| mean_of(orders[order - 1]) + mean_of(orders[order]);
        let unsure = |order: usize| {
            let factor = self.jackknife(|orders| positive(pair(orders, order), pair(orders, order - 2)))?;
            let (low, high) = factor.interval?;
            Some((order, (high - low) / (2.0 * factor.value))).filter(|(_, unsure)| *unsure < 1.0)
        };
        let all: Vec<(usize, f64)> = (FIRST_TELLER..=self.last()).filter_map(unsure).collect();
        let well = all.iter().rev().find(|(_, unsure)| *unsure <= TOLD_WELL);
        well.or_else(|| all.iter().min_by(|a, b| a.1.total_cmp(&b.1))).map(|(order, _)| *order)
    }

    /// Whether the factor is known to change from pair to pair at an order, and not by noise alone.
    fn is_changing(&self, order: usize) -> bool {
        let pair = |orders: &[[f64; 3]], back: usize| {
            let last = order.checked_sub(2 * back)?;
            Some(mean_of(orders[last]) + mean_of(orders[last.checked_sub(1)?]))
        };
        let factor = |orders: &[[f64; 3]], back| positive(pair(orders, back)?, pair(orders, back + 1)?);
        let step = self.jackknife(|orders| Some(factor(orders, 0)? - factor(orders, 1)?));
        step.and_then(|step| step.interval).is_none_or(|(low, high)| low > 0.0 || high < 0.0)
    }

    /// All orders that were measured, mean of channels.
    pub fn sum(&self) -> Estimate {
        let sum = |orders: &Vec<[f64; 3]>| orders.iter().map(|p| mean_of(*p)).sum();
        let values: Vec<f64> = self.replicates.iter().map(sum).collect();
        means::mean(&values)
    }

    /// All orders, and what is beyond the last.
    pub fn total(&self) -> Option<Estimate> {
        let beyond = self.beyond(0)?;
        let (first, rest) = (self.power(0), beyond.interval);
        let both = first.interval.zip(rest).map(|(a, b)| (a.0 + b.0, a.1 + b.1));
        Some(Estimate { value: first.value + beyond.value, interval: both, ..beyond })
    }

    /// The lowest order beyond which no more than this part of all is left, with 95 % confidence; `None` where that is beyond the last
    /// measured.
    pub fn order_for(&self, part: f64) -> Option<usize> {
        let (all, teller) = (self.total()?.value, self.teller()?);
        let left = |order: usize| {
            self.beyond_by(order, teller).and_then(|b| b.interval).map_or(f64::INFINITY, |(_, high)| high)
        };
        (0..=self.last()).find(|&order| left(order) <= part * all)
    }

    /// The means of orders over all replicates, or all but one.
    fn mean(&self, without: Option<usize>) -> Vec<[f64; 3]> {
        let kept = || self.replicates.iter().enumerate().filter(|(i, _)| Some(*i) != without).map(|(_, orders)| orders);
        let n = kept().count() as f64;
        let mean = |order: usize| [0, 1, 2].map(|c| kept().map(|orders| orders[order][c]).sum::<f64>() / n);
        (0..=self.last()).map(mean).collect()
    }

    /// A function of the means of orders, with its interval.
    fn jackknife(&self, of: impl Fn(&[[f64; 3]]) -> Option<f64>) -> Option<Estimate> {
        let (whole, n) = (of(&self.mean(None))?, self.replicates.len());
        let pseudo = |i: usize| Some(n as f64 * whole - (n as f64 - 1.0) * of(&self.mean(Some(i)))?);
        let pseudo: Option<Moments> = (0..n).map(pseudo).collect();
        let half = pseudo.as_ref().and_then(student).map(|(low, high)| (high - low) / 2.0);
        Some(Estimate::new(whole, half.map(|half| (whole - half, whole + half)), n, VALID_FROM))
    }
}

fn mean_of(channels: [f64; 3]) -> f64 {
    channels.iter().sum::<f64>() / 3.0
}

fn positive(a: f64, b: f64) -> Option<f64> {
    (b > 0.0).then(|| a / b)
}

/// Steps of the factor from pair to pair are taken to fall by this at the least from one to the next.
const SLOWEST: f64 = 10.0 / 11.0;

/// What is beyond the last order, mean of channels, if the factor from pair to pair stays what it is at the order that tells it (0), or rises
/// (1) or falls (−1) by another step, or, where steps go on, by all that may follow.
fn tail(orders: &[[f64; 3]], teller: usize, sign: f64, goes_on: bool) -> Option<f64> {
    let pair = |back: usize, c: usize| {
        let last = teller.checked_sub(2 * back)?;
        Some(orders.get(last)?[c] + orders.get(last.checked_sub(1)?)?[c])
    };
    let between = (orders.len() - 1).checked_sub(teller)?;
    let power = 1 + i32::try_from(between / 2).ok()?;
    let of = |c: usize| {
        let [last, before, first] = [pair(0, c)?, pair(1, c)?, pair(2, c)?];
        if last <= 0.0 {
            return Some(0.0);
        }
        let (q, earlier) = (positive(last, before)?, positive(before, first)?);
        let step = q - earlier;
        let fall = match pair(3, c).and_then(|third| positive(first, third)) {
            Some(earliest) if goes_on && earliest != earlier => (step / (earlier - earliest)).abs().min(SLOWEST),
            _ => 0.5,
        };
        let q = (q + sign * step.abs() * (fall / (1.0 - fall)).max(1.0)).max(0.0);
        // Of an odd number of orders between, the last is half a pair, and measured.
        let half = if between % 2 == 1 { orders.get(teller - 1)?[c] } else { 0.0 };
        (q < 1.0).then(|| (last / (1.0 - q) - half) * q.powi(power))
    };
    Some(mean_of([of(0)?, of(1)?, of(2)?]))
}

/// The same from the last orders themselves, if they go on falling by the factor of the order that tells it, or by that of the later half of the
/// orders after it, whichever is slower.
fn tail_of_last(orders: &[[f64; 3]], teller: usize) -> Option<f64> {
    let last = orders.len() - 1;
    let half = last.checked_sub(teller)?.div_ceil(2).max(1);
    let of = |c: usize| {
        let pair = |order: usize| Some(orders.get(order)?[c] + orders.get(order.checked_sub(1)?)?[c]);
        let [end, middle, told, before] =
            [pair(last)?, pair(last - half)?, pair(teller)?, pair(teller.checked_sub(2)?)?];
        if end <= 0.0 {
            return Some(0.0);
        }
        let q = positive(told, before)?.max(positive(end, middle)?.powf(2.0 / half as f64));
        (q < 1.0).then(|| end * q / (1.0 - q))
    };
    Some(mean_of([of(0)?, of(1)?, of(2)?]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use sampling::rng::{Stream, mix2};

    /// `Σ_j a_j λ_j^k` in every channel, with relative errors of one replicate that orders share in part.
    fn series(terms: &[(f64, f64)], last: usize, error: f64, seed: u64) -> Series {
        let mut stream = Stream::new(mix2(seed, 1), 0);
        let mut noise = move || (0..12).map(|_| f64::from(stream.next_f32())).sum::<f64>() - 6.0;
        let replicate = |_| {
            let shared = noise();
            let order = |k: usize| {
                let exact: f64 = terms.iter().map(|(a, l)| a * l.powi(k as i32)).sum();
                [exact * (1.0 + error * (0.8 * shared + 0.6 * noise())); 3]
            };
            (0..=last).map(order).collect()
        };
        Series::new((0..16).map(replicate).collect::<Vec<_>>())
    }

    #[test]
    fn a_geometric_series_is_told_to_the_last_digit() {
        let series = series(&[(2.0, 0.7)], 10, 0.0, 1);
        let radius = series.radius().unwrap();
        assert!((radius.estimate.value - 0.7).abs() < 1e-12 && radius.order == 8, "{radius:?}");
        assert!((series.total().unwrap().value - 2.0 / 0.3).abs() < 1e-12);
        assert!((series.beyond(3).unwrap().value - 2.0 * 0.7_f64.powi(4) / 0.3).abs() < 1e-12);
        // 0.7^(K + 1): 0.058 and 0.040.
        assert_eq!((series.order_for(0.05), series.order_for(0.01)), (Some(8), None));
        assert!((series.ratio(4).unwrap().value - 0.7).abs() < 1e-12);
    }

    #[test]
    fn eigenvalues_in_pairs_do_not_disturb() {
        // Nothing but every second order: 1, 0, .25, 0, … and 1.5, .25, …
        let series = series(&[(1.0, 0.5), (0.5, -0.5)], 11, 0.0, 1);
        let radius = series.radius().unwrap();
        assert!((radius.estimate.value - 0.5).abs() < 1e-12, "{radius:?}");
        assert!((series.total().unwrap().value - (2.0 + 0.5 / 1.5)).abs() < 1e-12);
    }

    /// The same where all that is left of later orders is noise, of an even number or an odd one.
    #[test]
    fn eigenvalues_in_pairs_do_not_disturb_where_earlier_orders_tell() {
        for last in [30, 31] {
            let mut series = series(&[(1.0, 0.7), (0.6, -0.7)], last, 1e-4, 7);
            find_by_chance(&mut series, 16);
            let teller = series.teller().unwrap();
            assert_eq!(teller, 15, "the last order that is told");
            let exact: f64 =
                [(1.0, 0.7_f64), (0.6, -0.7)].iter().map(|(a, l)| a * l.powi(last as i32 + 1) / (1.0 - l)).sum();
            let told = tail(&series.mean(None), teller, 0.0, false).unwrap();
            assert!((told / exact - 1.0).abs() < 0.02, "{last}: {told} {exact}");
        }
    }

    /// A mode that falls slowly and has begun to show: no noise, and still the interval knows that the factor goes on rising.
    #[test]
    fn what_the_factor_still_changes_is_in_the_interval() {
        for (terms, last) in
            [([(1.0, 0.7), (0.1, 0.95)], 14), ([(1.0, 0.88), (0.05, 0.97)], 40), ([(2.0, 0.6), (1.0, 0.8)], 9)]
        {
            let exact: f64 = terms.iter().map(|(a, l)| a / (1.0 - l)).sum();
            let total = series(&terms, last, 0.0, 1).total().unwrap();
            // Where the factor might reach 1, there is no upper end to tell.
            let covers = total.interval.is_none_or(|(low, high)| low < exact && exact < high);
            assert!(covers && total.value < exact, "{terms:?}: {total:?} {exact}");
        }
    }

    /// From an order on, one replicate in 16 finds it, with all of its light.
    fn find_by_chance(series: &mut Series, from: usize) {
        for (r, orders) in series.replicates.iter_mut().enumerate() {
            orders.iter_mut().enumerate().skip(from).for_each(|(k, power)| {
                *power = if (r + 5 * k) % 16 == 0 { power.map(|p| 16.0 * p) } else { [0.0; 3] };
            });
        }
    }

    /// Where all that is left of the last orders is noise, and most of it zeros, earlier ones tell how they fall.
    #[test]
    fn orders_that_chance_has_not_found_are_told_by_those_before() {
        let mut series = series(&[(2.0, 0.7)], 30, 0.02, 3);
        find_by_chance(&mut series, 16);
        let (low, high) = series.total().unwrap().interval.unwrap();
        assert!(low < 2.0 / 0.3 && 2.0 / 0.3 < high && high - low < 0.4, "{low} {high}");
        // 0.7^(K + 1) is 0.01 at 12.
        assert!(series.order_for(0.01).is_some_and(|order| (12..=14).contains(&order)), "{:?}", series.order_for(0.01));
    }

    /// A mode that falls slowly and shows itself where orders are noisy already is in the interval.
    #[test]
    fn what_shows_itself_in_noise_is_in_the_interval() {
        let (terms, last) = ([(1.0, 0.6_f64), (2e-4, 0.9)], 32);
        let exact: f64 = terms.iter().map(|(a, l)| a * l.powi(last as i32 + 1) / (1.0 - l)).sum();
        let mut covered = 0;
        for seed in 0..200 {
            let mut series = series(&terms, last, 0.01, seed);
            let mut stream = Stream::new(mix2(seed, 2), 0);
            for orders in &mut series.replicates {
                let found = 2.0 * f64::from(u8::from(stream.next_f32() < 0.5));
                orders.iter_mut().enumerate().for_each(|(k, power)| {
                    // Half of the replicates find the second mode, twice as bright.
                    let second = terms[1].0 * terms[1].1.powi(k as i32);
                    *power = power.map(|p| p + (found - 1.0) * second);
                });
            }
            let beyond = series.beyond(last).unwrap();
            // Where the factor might be 1, there is no interval.
            covered += usize::from(beyond.interval.is_none_or(|(low, high)| low <= exact && exact <= high));
        }
        // Binomial(200, 0.95) is below 178 with a probability of 10⁻⁴.
        assert!(covered >= 178, "{covered}");
    }

    /// 400 series, each with noise of its own: 95 % intervals of the total and of the radius, by a binomial test at 10⁻⁴. Terms that die out
    /// leave the total right.
    #[test]
    fn intervals_cover_what_they_should() {
        let terms = [(2.0, 0.8), (1.0, 0.3), (-0.2, -0.5)];
        let exact: f64 = terms.iter().map(|(a, l)| a / (1.0 - l)).sum();
        let (mut total, mut radius) = (0, 0);
        for seed in 0..400 {
            let series = series(&terms, 20, 0.01, seed);
            let (low, high) = series.total().unwrap().interval.unwrap();
            total += usize::from(low <= exact && exact <= high);
            let (low, high) = series.root(16, 0).unwrap().interval.unwrap();
            radius += usize::from(low <= 0.8 && 0.8 <= high);
        }
        // Binomial(400, 0.95) is below 361 with a probability of 10⁻⁴.
        assert!(total >= 361 && radius >= 361, "{total} {radius}");
        assert!(radius <= 396, "{radius}");
    }

    #[test]
    fn nothing_is_told_of_what_does_not_fall() {
        let flat = series(&[(1.0, 1.0)], 8, 0.0, 1);
        assert!(flat.total().is_none() && flat.order_for(0.1).is_none());
        assert!((flat.radius().unwrap().estimate.value - 1.0).abs() < 1e-12);
        let emission = Series::new(vec![vec![[1.0; 3], [0.0; 3], [0.0; 3], [0.0; 3], [0.0; 3], [0.0; 3]]; 8]);
        assert!(emission.radius().is_some_and(|radius| radius.estimate.value == 0.0));
        assert!((emission.total().unwrap().value - 1.0).abs() < 1e-12 && emission.order_for(1e-6) == Some(0));
        // An order that one replicate alone has found says that more was not, and no more than that.
        let mut found = vec![vec![[0.0; 3]; 12]; 8];
        found.iter_mut().for_each(|orders| orders[0] = [1.0; 3]);
        found[3][6] = [0.1; 3];
        assert!(Series::new(found).total().is_none());
    }
}
