//! Damaged and absurd tables.

use crate::attack::Class;

const HEADER: &str = "time_s,voltage_v,stiffness";

/// A table of rows of text.
fn table(rows: &[[String; 3]]) -> String {
    rows.iter().fold(format!("{HEADER}\n"), |table, row| table + &row.join(",") + "\n")
}

/// The report's spring on a stair of five levels, a row every `step_s`, with a reproducible noise.
fn record(rows: usize, step_s: f64) -> Vec<[String; 3]> {
    let mut relaxed = 0.0;
    let mut rows_of_text = Vec::new();
    for row in 0..rows {
        let volts = 100.0 * (row * 5 / rows + 1) as f64;
        relaxed += (volts - relaxed) * (1.0 - (-step_s / 5.5f64).exp());
        let noise = 0.5 * (12.9898 * row as f64).sin();
        let stiffness = 0.09 * volts + 0.91 * relaxed + noise;
        rows_of_text.push([format!("{:e}", step_s * row as f64), volts.to_string(), format!("{stiffness:.4}")]);
    }
    rows_of_text
}

/// A record with one changed cell.
fn with(row: usize, column: usize, cell: &str) -> Vec<u8> {
    let mut rows = record(400, 0.1);
    rows[row][column] = cell.to_owned();
    table(&rows).into_bytes()
}

fn of(rows: usize, row: impl Fn(usize) -> String) -> Vec<u8> {
    (0..rows).fold(format!("{HEADER}\n"), |table, number| table + &row(number) + "\n").into_bytes()
}

fn utf_16(text: &str, bytes: fn(u16) -> [u8; 2]) -> Vec<u8> {
    "\u{feff}".encode_utf16().chain(text.encode_utf16()).flat_map(bytes).collect()
}

/// Bytes without order, the same in each run.
fn noise(length: u32) -> Vec<u8> {
    (0..length).map(|n| (n.wrapping_mul(2_654_435_761) ^ n.wrapping_mul(40503) >> 7) as u8).collect()
}

/// Name and content of each table.
fn tables() -> Vec<(&'static str, Vec<u8>)> {
    let good = table(&record(400, 0.1));
    let reversed: Vec<[String; 3]> = record(400, 0.1).into_iter().rev().collect();
    let text = |text: String| text.into_bytes();
    vec![
        ("empty", Vec::new()),
        ("newline", text("\n".into())),
        ("comment", text("# nothing\n".into())),
        ("header", text(format!("{HEADER}\n"))),
        ("one row", text(table(&record(1, 0.1)))),
        ("two rows", text(table(&record(2, 0.1)))),
        ("three rows", text(table(&record(3, 0.1)))),
        ("constant", of(300, |n| format!("{n},100,50"))),
        ("zero", of(300, |n| format!("{n},0,0"))),
        ("dashes", of(300, |n| format!("{n},{},-", 100 * (n / 50)))),
        ("one reading", of(300, |n| format!("{n},{},{}", 100 * (n / 50), if n == 7 { "5" } else { "-" }))),
        ("NaN", with(7, 2, "NaN")),
        ("NaN as time", with(7, 0, "nan")),
        ("infinite", with(7, 2, "inf")),
        ("infinite voltage", with(7, 1, "-infinity")),
        ("1e308", with(7, 2, "1e308")),
        ("1e308 as voltage", with(7, 1, "1e308")),
        ("1e308 as time", with(399, 0, "1e308")),
        ("1e400", with(7, 2, "1e400")),
        ("denormal", of(300, |n| format!("{n},5e-324,5e-324"))),
        ("tiny times", text(table(&record(400, 1e-300)))),
        ("picoseconds", text(table(&record(2401, 1e-12)))),
        ("long times", text(table(&record(400, 1e9)))),
        ("longest times", text(format!("{HEADER}\n-1e308,0,0\n0,100,10\n1e308,100,50\n"))),
        ("last time 1e12", with(399, 0, "1e12")),
        ("last time 1e6", with(399, 0, "1e6")),
        ("minus zero", text(format!("{HEADER}\n-0.0,0,0\n0,100,10\n1,100,20\n"))),
        ("equal times", with(7, 0, "6e-1")),
        ("falling times", text(table(&reversed))),
        ("byte order mark", text(format!("\u{feff}{good}"))),
        ("CR LF", text(good.replace('\n', "\r\n"))),
        ("CR", text(good.replace('\n', "\r"))),
        ("UTF-16", utf_16(&good, u16::to_le_bytes)),
        ("UTF-16, big endian", utf_16(&good, u16::to_be_bytes)),
        ("half of UTF-16", utf_16(&good, u16::to_le_bytes)[..999].to_vec()),
        ("Latin-1", [b"# \xe9\n", good.as_bytes()].concat()),
        ("NUL", text(good.replace("100", "1\x000"))),
        ("NULs alone", vec![0; 100_000]),
        ("NULs at the end", text(good.clone() + "\0\0\0")),
        ("unclosed quote", with(7, 2, "\"5")),
        ("unclosed quote in the header", text(format!("\"{good}"))),
        ("quotes in a cell", with(7, 2, "5\"\"5")),
        ("quotes", text(format!("{HEADER}\n{}\n", "\"".repeat(500_000)))),
        ("newline in quotes", with(7, 2, "\"5\n6\"")),
        ("huge cell", with(7, 2, &"9".repeat(900_000))),
        ("many zeros", with(7, 2, &format!("0.{}1", "0".repeat(900_000)))),
        ("huge line", text(format!("{HEADER}\n{}\n", "1,".repeat(400_000)))),
        ("longer line", text(format!("{HEADER}\n{}\n", "1,".repeat(4_000_000)))),
        ("wide header", text((0..20_000).map(|n| format!("c{n},")).collect::<String>() + "\n1\n")),
        ("no column", text(good.replace("stiffness", "stiff"))),
        ("column twice", text(good.replace("stiffness", "voltage_v"))),
        ("ragged", text(format!("{HEADER}\n1\n2,3\n4,5,6,7\n"))),
        ("semicolons", text(good.replace(',', ";"))),
        ("tabs", text(good.replace(',', "\t"))),
        ("decimal comma", with(7, 1, "\"1,5\"")),
        ("hexadecimal", with(7, 1, "0x10")),
        ("underscore", with(7, 1, "1_0")),
        ("wide digits", with(7, 1, "１００")),
        ("typographic minus", with(7, 1, "−5")),
        ("invisible space", with(7, 1, "\u{200b}5")),
        ("escape", with(7, 1, "\x1b[2J\x1b]0;x\x07")),
        ("empty cell", with(7, 2, "")),
        ("dash as voltage", with(7, 1, "-")),
        ("blank lines", text("\n".repeat(900_000) + &good)),
        ("comments", text("#\n".repeat(400_000) + &good)),
        ("commas", text(",,\n".repeat(1000))),
        ("bytes", noise(200_000)),
        ("letters", noise(200_000).iter().map(|byte| b"0123456789.,-e\n#\" "[usize::from(*byte) % 18]).collect()),
        (
            "outliers",
            of(400, |n| format!("{},{},{}", 0.1 * n as f64, 100 * (n / 80), if n % 7 == 0 { 1e6 } else { 9.0 })),
        ),
        ("alternating", of(400, |n| format!("{},{},{}", 0.1 * n as f64, 700 * (n % 2), [1e6, -1e6][n % 2]))),
        ("large voltages", of(400, |n| format!("{n},1e6,1e6"))),
        ("stuck", of(2000, |n| format!("{},100,33.25", 0.1 * n as f64))),
        ("date", of(400, |n| format!("2026-01-31T23:59:{:02}.5,100,5", n % 60))),
        ("date beyond all years", of(400, |n| format!("+99999-01-31T23:59:{:02}.5,100,5", n % 60))),
        ("digits of a time", of(400, |n| format!("{}{n:03},100,5", "9".repeat(36)))),
        ("eight rows", text(table(&record(8, 0.1)))),
    ]
}

#[test]
fn damaged_tables_are_refused_or_answered() {
    let mut class = Class::new("tables");
    for (number, (name, content)) in tables().into_iter().enumerate() {
        let file = class.file(&format!("{number}.csv"), content);
        let file = file.to_str().expect("UTF-8");
        class.add(format!("diagnose {name}"), ["diagnose", "--effort", "quick", file, "--json"]);
        class.add(format!("identify {name}"), ["identify", file]);
        class.add(format!("stair {name}"), ["stair", "--input", file]);
        class.add(
            format!("stair linear {name}"),
            ["stair", "--input", file, "--between", "linear", "--controller", "fast"],
        );
        class.add(format!("dynamics {name}"), ["dynamics", "zener", "--input", file]);
    }
    let csv = class.file("good.csv", table(&record(400, 0.1)));
    let csv = csv.to_str().expect("UTF-8");
    for file in ["/dev/null", "/", "/nowhere/x.csv", "/proc/self/mem", "/dev/full", ""] {
        for command in [&["diagnose"][..], &["stair", "--input"], &["beam", "--experiment"], &["beam", "--layers"]] {
            class.add_ending(format!("{} {file}", command.join(" ")), command.iter().chain(&[file]), &[2]);
        }
    }
    for column in ["nothing", "", "time_s", &"a".repeat(100_000)] {
        class.add(format!("--column {column:.9}"), ["diagnose", "--effort", "quick", csv, "--column", column]);
    }
    class.run(|_, _| None);
}

#[test]
fn damaged_tables_of_beams_and_layers_are_refused_or_computed() {
    let mut class = Class::new("beams and layers");
    for (number, beam) in [
        "",
        "displacement_mm,force_un_0v\n",
        "displacement_mm,force_un_0v\n1,300\n",
        "displacement_mm,force_un_0v\n1,nan\n",
        "displacement_mm,force_un_0v\n1e308,1e308\n2,3\n",
        "displacement_mm,force_un_0v\n0,0\n0,0\n0,0\n",
        "displacement_mm,force_un_0v,force_un_400v\n1,300,400\n1,300,400\n",
        "displacement_mm,force_un_0v\n-1,-300\n-2,-4\n",
        "displacement_mm,force_un_0v\n1e-300,1e-300\n2e-300,2e-300\n",
        "displacement_mm,force_un_xv\n1,2\n2,3\n",
        "displacement_mm,force_un_0v,force_un_1e308v\n1,300,400\n2,310,420\n",
        "displacement_mm,force_un_0v\n\0,\0\n",
        "displacement_mm,force_un_0v\n59.8,300\n590,310\n",
    ]
    .iter()
    .enumerate()
    {
        let file = class.file(&format!("beam{number}.csv"), beam);
        class.add(format!("{beam:?}"), ["beam", "--experiment", file.to_str().expect("UTF-8")]);
    }
    let head = "material,youngs_modulus_gpa,length_mm,width_mm,thickness_um,count\n";
    let many = ["PET"; 3000].join(",");
    for (number, layer) in [
        "",
        "PET,0,0,0,0,0",
        "PET,-1,-1,-1,-1,1",
        "PET,nan,1,1,1,1",
        "PET,1e308,1e308,1e308,1e308,1",
        "PET,3,59,19,20,99999999999",
        "PET,3,59,19,20,1000000",
        "PET,1e-300,1e-300,1e-300,1e-300,1",
        "PET,3,59,19,20,1",
        "PET,3,59,19,20,3000",
    ]
    .iter()
    .enumerate()
    {
        let file = class.file(&format!("layers{number}.csv"), format!("{head}{layer}\n"));
        let file = file.to_str().expect("UTF-8");
        class.add(format!("{layer} as in the report"), ["beam", "--layers", file]);
        class.add(format!("{layer} alone"), ["beam", "--layers", file, "--stack", "PET"]);
        class.add(format!("{layer}, 3000 of them"), ["beam", "--layers", file, "--stack", &many]);
    }
    class.run(|_, _| None);
}
