//! `OUTPUT_FIELDS` and `INPUT_FIELDS` against the tables under `fixtures/spec`.

use fieldarm::wire::meca500::image::{Field, INPUT_FIELDS, INPUT_LEN, OUTPUT_FIELDS, OUTPUT_LEN};

const COLUMNS: [&str; 11] = [
    "section",
    "field",
    "type",
    "byte_offset",
    "bit",
    "size_bits",
    "ecat_index",
    "pdo",
    "pdo_subindex",
    "table",
    "meca500_support",
];

fn cells(field: &Field) -> [String; 11] {
    [
        field.section.to_owned(),
        field.name.to_owned(),
        field.field_type.name().to_owned(),
        field.byte_offset.to_string(),
        field.bit.to_string(),
        field.size_bits.to_string(),
        format!("{:04X}h", field.object),
        format!("{:04X}h", field.pdo),
        field.sub_index.map_or_else(String::new, |sub_index| sub_index.to_string()),
        format!("Table {}", field.table),
        field.support.name().to_owned(),
    ]
}

fn assert_equal_to_fixture(fields: &[Field], file: &str) {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("fixtures/spec").join(file);
    let mut reader = csv::Reader::from_path(path).expect("the fixture can be read");
    let headers = reader.headers().expect("the fixture has a header").clone();
    let columns = COLUMNS.map(|name| {
        headers.iter().position(|header| header == name).unwrap_or_else(|| panic!("no {name}"))
    });
    let rows: Vec<csv::StringRecord> =
        reader.records().collect::<Result<_, _>>().expect("every row can be read");
    for (number, (row, field)) in rows.iter().zip(fields).enumerate() {
        let wanted = columns.map(|column| row[column].to_owned());
        assert_eq!(cells(field), wanted, "{file}, row {}", number + 1);
    }
    assert_eq!(fields.len(), rows.len(), "{file} has another number of rows");
}

#[test]
fn output_fields_equal_the_specification_row_by_row() {
    assert_equal_to_fixture(OUTPUT_FIELDS, "meca500_output_fields.csv");
}

#[test]
fn input_fields_equal_the_specification_row_by_row() {
    assert_equal_to_fixture(INPUT_FIELDS, "meca500_input_fields.csv");
}

fn assert_each_bit_covered_once(fields: &[Field], len: usize) {
    let mut covered = vec![0; 8 * len];
    for field in fields {
        let first = 8 * usize::from(field.byte_offset) + usize::from(field.bit);
        for bit in &mut covered[first..first + usize::from(field.size_bits)] {
            *bit += 1;
        }
    }
    let wrong: Vec<usize> = (0..covered.len()).filter(|&bit| covered[bit] != 1).collect();
    assert_eq!(wrong, [0; 0], "bits covered not at all or twice");
}

#[test]
fn the_480_output_bits_are_covered_once() {
    assert_eq!(8 * OUTPUT_LEN, 480);
    assert_each_bit_covered_once(OUTPUT_FIELDS, OUTPUT_LEN);
}

#[test]
fn the_2016_input_bits_are_covered_once() {
    assert_eq!(8 * INPUT_LEN, 2016);
    assert_each_bit_covered_once(INPUT_FIELDS, INPUT_LEN);
}

#[test]
fn fields_are_in_the_order_of_the_image_and_say_what_they_mean() {
    for fields in [OUTPUT_FIELDS, INPUT_FIELDS] {
        let places: Vec<_> = fields.iter().map(|field| (field.byte_offset, field.bit)).collect();
        assert!(places.is_sorted());
        assert!(fields.iter().all(|field| !field.doc.is_empty()));
    }
}
