//! The light that a method loses, in words: an expression, what it stands for, and the orders, where it is lost in some alone.
//!
//! `LS.*E: what is seen in mirrors` is lost in all orders that such a path can have, `LS.*E: what is seen in mirrors (orders 2-4+tail)` in those
//! alone. Words are what results keep, so that whoever reads them knows what a method's means are good for.

use super::Expression;
use crate::measurement::Layer;
use crate::request::Orders;
use scenes::description::MAX_ORDER;

/// What stands before the orders.
const ORDERS: &str = " (orders ";

/// The lowest order that a path of this class can have. Whatever follows the expression, which ends at the eye, is left alone; 0
/// for what is no expression, which might be anything.
pub(super) fn least_order(class: &str) -> usize {
    let expression = class.find('E').and_then(|end| Expression::parse(&class[..=end]).ok());
    expression.map_or(0, |expression| expression.orders().0)
}

/// The class, told to be lost in these orders alone, and in the tail if so; `None` where no path of it has one of them.
pub fn lost_in(class: &str, orders: &Orders, tail: bool) -> Option<String> {
    let least = least_order(class);
    let own = orders.clone().only(|k| k >= least).to_string();
    let tail = if tail { "tail" } else { "" };
    let and = if own.is_empty() || tail.is_empty() { "" } else { "+" };
    let list = format!("{own}{and}{tail}");
    (!list.is_empty()).then(|| format!("{class}{ORDERS}{list})"))
}

/// The class with the orders that lose it.
pub fn told(class: &str) -> String {
    match least_order(class) {
        least if least > 0 && some_orders(class).is_none() => format!("{class}{ORDERS}{least} and above)"),
        _ => class.to_owned(),
    }
}

/// Whether a layer may lack light of the class.
pub fn loses(class: &str, layer: Layer) -> bool {
    let some = some_orders(class);
    match layer {
        Layer::Order(k) => k >= least_order(class) && some.is_none_or(|(orders, _)| orders.contains(k)),
        Layer::Tail => some.is_none_or(|(_, tail)| tail),
    }
}

/// The orders that alone lose a class, and whether the tail does.
fn some_orders(class: &str) -> Option<(Orders, bool)> {
    let list = class.rsplit_once(ORDERS)?.1.strip_suffix(')')?;
    let (list, tail) = list.strip_suffix("tail").map_or((list, false), |orders| (orders.trim_end_matches('+'), true));
    match list {
        "" => Some((Orders::up_to(0).only(|_| false), tail)),
        list => Some((Orders::parse(list, MAX_ORDER).ok()?, tail)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn scatterings_that_must_be_are_counted() {
        let cases =
            [("LE", 0), ("LSE", 1), ("L.*SE: mirrors", 1), ("LS.*E from points", 1), ("L(D|S)(D|S)+E: deep", 2)];
        for (class, least) in cases.into_iter().chain([
            ("LD+S*DE", 2),
            ("paths of some kind", 0),
            ("L(D|S", 0),
            ("LX", 0),
            ("L(SD){2}E", 4),
        ]) {
            assert_eq!(least_order(class), least, "{class}");
        }
    }

    #[test]
    fn orders_are_read_from_words_as_they_were_written() {
        let of = |list: &str| match list {
            "" => Orders::up_to(8).only(|_| false),
            list => Orders::parse(list, 8).unwrap(),
        };
        for (list, tail) in [("1", false), ("2-4", true), ("0,3,5-8", false), ("", true)] {
            let class = lost_in("L.*SE: mirrors (and glass)", &of(list), tail).unwrap();
            assert_eq!(told(&class), class);
            let lost: Vec<usize> = (0..=9).filter(|&k| loses(&class, Layer::Order(k))).collect();
            assert_eq!(lost, of(list).iter().filter(|&k| k > 0).collect::<Vec<_>>(), "{class}");
            assert_eq!(loses(&class, Layer::Tail), tail, "{class}");
        }
        assert_eq!(lost_in("L.*SE: mirrors", &of("0"), false), None);
        let whole = told("L(D|S)(D|S)+E: deep");
        assert_eq!(whole, "L(D|S)(D|S)+E: deep (orders 2 and above)");
        assert!(loses(&whole, Layer::Order(2)) && !loses(&whole, Layer::Order(1)) && loses(&whole, Layer::Tail));
        assert!(loses("paths of some kind", Layer::Order(0)) && told("paths of some kind") == "paths of some kind");
    }
}
