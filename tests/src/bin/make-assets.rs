//! Writes the scenes that this project makes itself: `cargo run -p vlm-tests --bin make-assets [FOLDER]`.

use std::path::PathBuf;
use std::process::ExitCode;

fn main() -> ExitCode {
    let folder = std::env::args_os().nth(1).map_or_else(|| PathBuf::from("assets"), PathBuf::from);
    for (name, bytes) in vlm_tests::cornell::all() {
        let path = folder.join(name);
        if let Err(error) = std::fs::write(&path, &bytes) {
            eprintln!("{}: {error}", path.display());
            return ExitCode::from(2);
        }
        println!("{}  {} bytes  blake3 {}", path.display(), bytes.len(), blake3::hash(&bytes).to_hex());
    }
    ExitCode::SUCCESS
}
