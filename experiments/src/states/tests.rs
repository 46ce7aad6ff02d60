use super::*;
use integrators::state::Stored;
use tempfile::TempDir;

fn states() -> (TempDir, States) {
    let home = tempfile::tempdir().unwrap();
    let states = States::open(home.path(), None);
    states.create().unwrap();
    (home, states)
}

fn unit(origin: &str) -> Unit {
    Unit::new("scene-path-image", origin)
}

fn save(states: &mut States, unit: &Unit, values: &Vec<f64>) {
    states.save(unit, values.len() as u32, |to| values.write(to)).unwrap();
}

fn load(states: &mut States, unit: &Unit) -> Option<Vec<f64>> {
    states.load(unit, Stored::read).unwrap()
}

fn names(home: &TempDir) -> Vec<String> {
    let entries = fs::read_dir(home.path().join(FOLDER)).into_iter().flatten();
    let mut names: Vec<String> = entries.map(|e| e.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_state_is_found_by_what_its_numbers_follow_from() {
    let (_home, mut states) = states();
    let values = vec![1.0, -0.0, f64::NAN];
    save(&mut states, &unit("a"), &values);
    let read = load(&mut states, &unit("a")).unwrap();
    assert!(read.iter().zip(&values).all(|(a, b)| a.to_bits() == b.to_bits()));
    assert_eq!(states.replicates(&unit("a")), Some(3));
    assert_eq!((load(&mut states, &unit("b")), states.replicates(&unit("b"))), (None, None));
}

#[test]
fn a_state_that_is_cut_or_changed_is_set_aside() {
    let (home, mut states) = states();
    let unit = unit("a");
    save(&mut states, &unit, &vec![1.0, 2.0]);
    let path = home.path().join(FOLDER).join(&unit.file);
    let whole = fs::read(&path).unwrap();
    let mut damaged: Vec<Vec<u8>> = (0..whole.len()).map(|length| whole[..length].to_vec()).collect();
    for at in 0..whole.len() {
        let mut changed = whole.clone();
        changed[at] ^= 1;
        damaged.push(changed);
    }
    damaged.push([&whole[..], &[0]].concat());
    for bytes in damaged {
        fs::write(&path, bytes).unwrap();
        assert_eq!(load(&mut states, &unit), None);
        assert_eq!(names(&home), [format!("{}.damaged", unit.file)]);
    }
    fs::write(&path, &whole).unwrap();
    assert_eq!(load(&mut states, &unit), Some(vec![1.0, 2.0]));
}

#[test]
fn a_disk_that_fills_up_leaves_the_state_before() {
    let (home, mut states) = states();
    let unit = unit("a");
    save(&mut states, &unit, &vec![1.0]);
    let full = |to: &mut dyn Write| {
        to.write_all(&vec![7; 3 << 20])?;
        Err(io::Error::from(io::ErrorKind::StorageFull))
    };
    let message = states.save(&unit, 2, full).unwrap_err().to_string();
    assert!([&unit.file, "no storage space", "make room"].iter().all(|word| message.contains(*word)), "{message}");
    assert_eq!(names(&home), [unit.file.as_str()]);
    assert_eq!(load(&mut states, &unit), Some(vec![1.0]));
}

#[test]
fn what_pilots_chose_is_kept_with_the_states_of_the_run_and_nothing_else_is() {
    let (home, mut states) = states();
    assert_eq!(states.chosen(&unit("a"), || Ok(16)).unwrap(), 16);
    assert_eq!(states.chosen(&unit("b"), || Ok(8)).unwrap(), 8);
    save(&mut states, &unit("old"), &vec![1.0]);
    save(&mut states, &unit("new"), &vec![1.0]);
    fs::write(home.path().join("state/mine.txt"), "kept").unwrap();
    fs::write(home.path().join("state/.x.state.77-0.tmp"), "half").unwrap();

    let mut states = States::open(home.path(), None);
    states.create().unwrap();
    assert!(!names(&home).iter().any(|name| name.ends_with(".tmp")));
    assert!(load(&mut states, &unit("new")).is_some());
    assert_eq!(states.chosen::<u32>(&unit("b"), || panic!("chosen before")).unwrap(), 8);
    states.end().unwrap();
    assert_eq!(names(&home), [CHOSEN, "mine.txt", &unit("new").file]);

    let mut states = States::open(home.path(), None);
    states.clear().unwrap();
    assert_eq!(states.chosen(&unit("b"), || Ok(4)).unwrap(), 4);
}

#[test]
fn a_folder_without_work_is_removed() {
    let (home, states) = states();
    drop(states);
    assert!(!home.path().join(FOLDER).exists());
}
