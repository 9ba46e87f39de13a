//! Files are followed however they are saved.

#![allow(clippy::unwrap_used, reason = "a test fails by panicking")]

use std::fs;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use tempfile::TempDir;
use vlm_bake::follow::{FollowOptions, Follower};

/// Long enough on a busy machine.
const PATIENCE: Duration = Duration::from_secs(20);

/// Nothing is expected to come in this time.
const SILENCE: Duration = Duration::from_millis(1500);

fn polling() -> FollowOptions {
    FollowOptions { events: false, look_every: Duration::from_millis(50), ..FollowOptions::default() }
}

/// A folder with a followed file, by events and by polling.
fn each_way(test: impl Fn(&Path, PathBuf, Follower)) {
    for options in [FollowOptions::default(), polling()] {
        let folder = TempDir::new().unwrap();
        let file = folder.path().join("scene.gltf");
        fs::write(&file, "one").unwrap();
        let mut follower = Follower::new(options).unwrap();
        follower.follow([file.clone()]);
        test(folder.path(), file, follower);
    }
}

fn assert_changes(follower: &mut Follower, file: &Path) {
    let change = follower.wait(PATIENCE).expect("the change shows");
    assert_eq!(change.files, [file]);
}

fn assert_silent(follower: &mut Follower) {
    assert_eq!(follower.wait(SILENCE), None);
}

#[test]
fn written_in_place() {
    each_way(|_, file, mut follower| {
        assert_silent(&mut follower);
        fs::write(&file, "two").unwrap();
        assert_changes(&mut follower, &file);
        assert_silent(&mut follower);
    });
}

#[test]
fn the_same_content_is_no_change() {
    each_way(|_, file, mut follower| {
        fs::write(&file, "one").unwrap();
        assert_silent(&mut follower);
    });
}

#[test]
fn renamed_over() {
    each_way(|folder, file, mut follower| {
        for content in ["two", "six"] {
            let other = folder.join(".scene.gltf.swp");
            fs::write(&other, content).unwrap();
            fs::rename(&other, &file).unwrap();
            assert_changes(&mut follower, &file);
        }
        assert_silent(&mut follower);
    });
}

#[test]
fn linked_into_place() {
    each_way(|folder, file, mut follower| {
        let other = folder.join("nameless");
        fs::write(&other, "two").unwrap();
        fs::remove_file(&file).unwrap();
        fs::hard_link(&other, &file).unwrap();
        assert_changes(&mut follower, &file);
    });
}

#[test]
fn deleted_and_made_again() {
    each_way(|_, file, mut follower| {
        fs::remove_file(&file).unwrap();
        assert_changes(&mut follower, &file);
        fs::write(&file, "two").unwrap();
        assert_changes(&mut follower, &file);
    });
}

#[test]
fn its_folder_deleted_and_made_again() {
    each_way(|folder, file, mut follower| {
        let inner = folder.join("inner");
        let file_there = inner.join("scene.gltf");
        fs::create_dir(&inner).unwrap();
        fs::rename(&file, &file_there).unwrap();
        follower.follow([file_there.clone()]);
        fs::remove_dir_all(&inner).unwrap();
        assert_changes(&mut follower, &file_there);
        fs::create_dir(&inner).unwrap();
        fs::write(&file_there, "two").unwrap();
        assert_changes(&mut follower, &file_there);
        // The new folder gives events again: far sooner than a look would find it.
        assert_silent(&mut follower);
        fs::write(&file_there, "three").unwrap();
        assert_changes(&mut follower, &file_there);
    });
}

#[cfg(unix)]
#[test]
fn the_target_of_a_link() {
    use std::os::unix::fs::symlink;
    each_way(|folder, file, mut follower| {
        let (one, two) = (folder.join("v1"), folder.join("v2"));
        for (version, content) in [(&one, "one"), (&two, "two")] {
            fs::create_dir(version).unwrap();
            fs::write(version.join("scene.gltf"), content).unwrap();
        }
        fs::remove_file(&file).unwrap();
        symlink(one.join("scene.gltf"), &file).unwrap();
        assert_silent(&mut follower);
        fs::write(one.join("scene.gltf"), "changed").unwrap();
        assert_changes(&mut follower, &file);
        let next = folder.join("next");
        symlink(two.join("scene.gltf"), &next).unwrap();
        fs::rename(&next, &file).unwrap();
        assert_changes(&mut follower, &file);
    });
}

#[test]
fn a_slow_save_ends_whole() {
    each_way(|_, file, mut follower| {
        let writer = {
            let file = file.clone();
            std::thread::spawn(move || {
                let mut file = fs::File::create(file).unwrap();
                for _ in 0..40 {
                    file.write_all(&[7; 1000]).unwrap();
                    file.flush().unwrap();
                    std::thread::sleep(Duration::from_millis(20));
                }
            })
        };
        let started = Instant::now();
        let mut last = 0;
        while last < 40_000 && started.elapsed() < PATIENCE {
            if follower.wait(PATIENCE).is_some() {
                last = fs::metadata(&file).unwrap().len();
            }
        }
        writer.join().unwrap();
        assert_eq!(last, 40_000, "the last change shows the whole file");
    });
}

#[test]
fn a_storm_beside_it_wakes_nobody_and_hides_nothing() {
    each_way(|folder, file, mut follower| {
        let storm = |count: usize| {
            for i in 0..count {
                fs::write(folder.join(format!("other{}", i % 50)), i.to_string()).unwrap();
            }
        };
        storm(5000);
        fs::write(&file, "two").unwrap();
        storm(5000);
        assert_changes(&mut follower, &file);
        assert_silent(&mut follower);
    });
}

#[test]
fn files_come_and_go() {
    each_way(|folder, file, mut follower| {
        let buffer = folder.join("scene.bin");
        follower.follow([file.clone(), buffer.clone()]);
        fs::write(&buffer, "data").unwrap();
        assert_changes(&mut follower, &buffer);
        fs::write(&file, "two").unwrap();
        // What changed before the new list is not lost.
        follower.follow([file.clone()]);
        assert_changes(&mut follower, &file);
        fs::write(&buffer, "more").unwrap();
        assert_silent(&mut follower);
    });
}

#[test]
fn events_come_sooner_than_looks() {
    let folder = TempDir::new().unwrap();
    let file = folder.path().join("scene.gltf");
    let never = Duration::from_secs(3600);
    let mut follower =
        Follower::new(FollowOptions { look_every: never, ..FollowOptions::default() }).unwrap();
    follower.follow([file.clone()]);
    fs::write(&file, "two").unwrap();
    assert_changes(&mut follower, &file);
    // Without either, nothing shows: the test above cannot pass by itself.
    let deaf = FollowOptions { look_every: never, events: false, ..FollowOptions::default() };
    let mut follower = Follower::new(deaf).unwrap();
    follower.follow([file.clone()]);
    fs::write(&file, "three").unwrap();
    assert_silent(&mut follower);
}
