//! Which orders of the series are asked for.

use crate::measurement::Layer;
use crate::parts::Parts;
use scenes::description::MAX_ORDER;
use std::fmt;
use std::ops::RangeInclusive;

/// A set of orders in `0..=max_order`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Orders {
    max_order: usize,
    wanted: Vec<bool>,
}

impl Orders {
    /// Every order up to `max_order`, that one included.
    pub fn up_to(max_order: usize) -> Self {
        Self { max_order, wanted: vec![true; max_order + 1] }
    }

    /// The orders of a list such as `0,2,4-6` (ends included), none above `max_order`.
    ///
    /// # Errors
    /// A sentence that names the part of the list that is no order or range, or lies above `max_order`.
    pub fn parse(list: &str, max_order: usize) -> Result<Self, String> {
        let mut wanted = vec![false; max_order + 1];
        for part in list.split(',').map(str::trim) {
            let (first, last) = part.split_once('-').unwrap_or((part, part));
            let number = |text: &str| text.trim().parse::<usize>().ok();
            let (Some(first), Some(last)) = (number(first), number(last)) else {
                return Err(format!("`{part}` is neither an order nor a range of orders; write for example 0,2,4-6"));
            };
            if first > last {
                return Err(format!("the range `{part}` runs backwards; write {last}-{first}"));
            }
            if last > MAX_ORDER {
                return Err(format!("order {last} lies above {MAX_ORDER}, the highest there is; leave it out"));
            }
            if last > max_order {
                return Err(format!(
                    "order {last} lies above max_order {max_order}; raise --max-order to {last} or leave it out"
                ));
            }
            wanted[first..=last].fill(true);
        }
        Ok(Self { max_order, wanted })
    }

    /// The last order of the truncated series.
    pub fn max_order(&self) -> usize {
        self.max_order
    }

    /// Whether order `k` is asked for.
    #[inline]
    pub fn contains(&self, k: usize) -> bool {
        self.wanted.get(k).copied().unwrap_or(false)
    }

    /// The orders asked for, rising.
    pub fn iter(&self) -> impl Iterator<Item = usize> {
        (0..=self.max_order).filter(|&k| self.wanted[k])
    }

    /// Those of the orders that lie in a range.
    pub fn within(self, range: RangeInclusive<usize>) -> Self {
        self.only(|k| range.contains(&k))
    }

    /// Those of the orders of which this is true.
    pub fn only(mut self, is_one: impl Fn(usize) -> bool) -> Self {
        self.wanted.iter_mut().enumerate().for_each(|(k, wanted)| *wanted &= is_one(k));
        self
    }

    /// Whether the whole truncated series is asked for.
    pub fn is_all(&self) -> bool {
        self.wanted.iter().all(|&w| w)
    }
}

impl fmt::Display for Orders {
    /// As [`Orders::parse`] takes it: `0,2-4`.
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        let mut orders = self.iter().peekable();
        let mut comma = "";
        while let Some(first) = orders.next() {
            let mut last = first;
            while let Some(next) = orders.next_if_eq(&(last + 1)) {
                last = next;
            }
            write!(f, "{comma}{first}")?;
            if last > first {
                write!(f, "-{last}")?;
            }
            comma = ",";
        }
        Ok(())
    }
}

/// What a render estimates, in the form the methods read.
#[derive(Clone, Debug)]
pub struct Request {
    orders: Orders,
    tail: bool,
    layer_of_order: Vec<Option<u32>>,
    layers: Vec<Layer>,
    last: Option<usize>,
    parts: Parts,
    fireflies: bool,
    runs: Vec<Request>,
}

impl Request {
    /// The given orders and, with `tail`, all that lies beyond `max_order`.
    pub fn new(orders: Orders, tail: bool) -> Self {
        let mut layer_of_order = vec![None; orders.max_order() + 1];
        let mut layers = Vec::new();
        for k in orders.iter() {
            layer_of_order[k] = Some(layers.len() as u32);
            layers.push(Layer::Order(k));
        }
        let last = if tail { None } else { orders.iter().last() };
        if tail {
            layers.push(Layer::Tail);
        }
        Self { orders, tail, layer_of_order, layers, last, parts: Parts::default(), fireflies: false, runs: Vec::new() }
    }

    /// The same, the image being taken apart.
    pub fn with_parts(self, parts: Parts) -> Self {
        Self { parts, ..self }
    }

    /// The same, shared out to the runs of a composite.
    pub fn with_runs(self, runs: Vec<Request>) -> Self {
        Self { runs, ..self }
    }

    /// What each run of a composite is asked for.
    pub fn runs(&self) -> &[Request] {
        &self.runs
    }

    /// The same, the largest contributions being kept with what makes each again.
    pub fn with_fireflies(self) -> Self {
        Self { fireflies: true, ..self }
    }

    /// Whether the largest contributions are kept.
    pub fn keeps_fireflies(&self) -> bool {
        self.fireflies
    }

    /// What the image is taken apart into.
    #[inline]
    pub fn parts(&self) -> &Parts {
        &self.parts
    }

    /// How many layers the film has, those of the parts included.
    pub fn film_layers(&self) -> usize {
        self.layers.len() + self.parts.list().len()
    }

    /// The layers of the film that make up the image, in rising order.
    pub fn layers(&self) -> &[Layer] {
        &self.layers
    }

    /// The orders asked for one by one.
    pub fn orders(&self) -> &Orders {
        &self.orders
    }

    /// Whether what lies beyond `max_order` is asked for.
    pub fn tail(&self) -> bool {
        self.tail
    }

    /// Whether a path of this order counts.
    #[inline]
    pub fn wants(&self, order: usize) -> bool {
        self.layer(order).is_some()
    }

    /// Whether any path of this or a higher order counts: whether a walk should go on.
    #[inline]
    pub fn wants_from(&self, order: usize) -> bool {
        self.last.is_none_or(|last| order <= last)
    }

    /// The last order that counts; `None` where there is no last one.
    #[inline]
    pub fn last_order(&self) -> Option<usize> {
        self.last
    }

    /// The film layer that takes paths of this order.
    #[inline]
    pub fn layer(&self, order: usize) -> Option<usize> {
        match self.layer_of_order.get(order) {
            Some(layer) => layer.map(|l| l as usize),
            None if self.tail => Some(self.layers.len() - 1),
            None => None,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lists_of_orders_are_read() {
        let orders = Orders::parse("0, 2,4-6", 8).unwrap();
        assert_eq!(orders.iter().collect::<Vec<_>>(), [0, 2, 4, 5, 6]);
        assert!(!orders.is_all() && Orders::parse("0-8", 8).unwrap().is_all());
    }

    #[test]
    fn lists_of_orders_are_written_as_they_are_read() {
        for list in ["0,2,4-6", "0-8", "3", "7-8"] {
            assert_eq!(Orders::parse(list, 8).unwrap().to_string(), list);
        }
        assert_eq!(Orders::up_to(3).only(|_| false).to_string(), "");
    }

    #[test]
    fn bad_lists_name_the_bad_part() {
        assert!(Orders::parse("1,x", 8).unwrap_err().contains("`x`"));
        assert!(Orders::parse("6-4", 8).unwrap_err().contains("4-6"));
        assert!(Orders::parse("9", 8).unwrap_err().contains("max_order 8"));
    }

    #[test]
    fn layers_follow_the_orders_and_the_tail_comes_last() {
        let request = Request::new(Orders::parse("1,3", 4).unwrap(), true);
        assert_eq!(request.layers(), [Layer::Order(1), Layer::Order(3), Layer::Tail]);
        assert_eq!((request.layer(1), request.layer(2), request.layer(5)), (Some(0), None, Some(2)));
        assert!(request.wants_from(1_000));
        assert!(!Request::new(Orders::parse("1,3", 4).unwrap(), false).wants_from(4));
    }
}
