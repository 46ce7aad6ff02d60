use super::*;
use crate::contribution::Technique;
use crate::request::Orders;
use sampling::vec2;

fn contribution(x: f32, y: f32, value: f32) -> Contribution<'static> {
    Contribution::new(vec2(x, y), Technique::Connect { s: 1, t: 1 }, Spectrum::splat(value), 1.0)
}

fn raster(width: u32, height: u32, filter: Filter) -> Raster {
    Raster::new(width, height, filter, Edges::Border)
}

/// Whichever block a contribution is made in, and however the window lies to the tiles.
#[test]
fn a_window_of_the_film_holds_what_the_film_holds_there() {
    let (width, height) = (37, 40);
    let request = Request::new(Orders::up_to(0), false);
    let filled = |window: &Window, tile: Window| {
        let mut film = Film::new(window.width(), window.height(), 1);
        let mut block =
            BlockFilm::new(BlockStore::default(), &request, raster(width, height, Filter::Mitchell), window.clone());
        block.start(tile);
        for i in 0..500 {
            let (x, y) = ((i * 7 % 400) as f32 * 0.1 - 1.5, (i * 13 % 430) as f32 * 0.1 - 1.5);
            block.add(contribution(x, y, 1.0 + i as f32));
        }
        film.reduce(&[block]);
        film.sums
    };
    for tile in [Window { x: 16..32, y: 16..32 }, Window { x: 32..37, y: 32..40 }] {
        let whole = filled(&Window::whole(width, height), tile.clone());
        for window in [Window { x: 5..29, y: 7..39 }, Window { x: 36..37, y: 0..1 }, Window { x: 16..32, y: 16..32 }] {
            let part = filled(&window, tile.clone());
            for (i, sums) in part.chunks(3).enumerate() {
                let (x, y) = (window.x.start + i as u32 % window.width(), window.y.start + i as u32 / window.width());
                let at = (y * width + x) as usize * 3;
                assert_eq!(sums, &whole[at..at + 3], "{window:?} {x} {y}");
            }
        }
    }
}

#[test]
fn every_contribution_on_the_film_is_added_once_and_none_beyond_its_border() {
    let (width, height) = (37, 18);
    let request = Request::new(Orders::up_to(0), false);
    let mut film = Film::new(width, height, 1);
    let mut block = BlockFilm::new(
        BlockStore::default(),
        &request,
        raster(width, height, Filter::Box),
        Window::whole(width, height),
    );
    block.start(Window { x: 16..32, y: 0..16 });
    for y in -1..=height as i32 {
        for x in -1..=width as i32 {
            block.add(contribution(x as f32, y as f32, 1.0));
        }
    }
    block.add(contribution(37.0_f32.next_down(), 17.0, 1.0));
    block.add(contribution(-f32::MIN_POSITIVE, 3.0, 1.0));
    film.reduce(&[block]);
    let doubled = 17 * 37 + 36;
    for (pixel, sum) in film.sums.chunks(3).enumerate() {
        assert_eq!(sum[0], if pixel == doubled { 2.0 } else { 1.0 }, "pixel {pixel}");
    }
}

#[test]
fn non_finite_contributions_are_counted_and_left_out() {
    let request = Request::new(Orders::up_to(1), false);
    let mut block = BlockFilm::new(BlockStore::default(), &request, raster(4, 4, Filter::Box), Window::whole(4, 4));
    block.start(Window { x: 0..4, y: 0..4 });
    block.add(contribution(1.0, 1.0, f32::NAN));
    block.add(contribution(1.0, 1.0, f32::INFINITY));
    assert_eq!(block.invalid, [2, 0]);
    assert!(block.sums.iter().all(|&s| s == 0.0));
}
