//! The process images of the Meca500 against three witnesses: the manual's tables as somebody else
//! typed them, byte vectors typed by hand, and properties that hold for any bytes and values.

mod wire_meca500_image {
    mod behaviour;
    mod expected;
    mod properties;
    mod tables;
    mod vectors;

    use fieldarm::wire::meca500::image::FieldValue;

    /// Runs `$test::<O>(..)` in each of the four byte orders.
    macro_rules! in_each_order {
        ($test:ident $(, $argument:expr)*) => {
            $test::<fieldarm::wire::order::Big>($($argument),*);
            $test::<fieldarm::wire::order::Little>($($argument),*);
            $test::<fieldarm::wire::order::BigIntLittleReal>($($argument),*);
            $test::<fieldarm::wire::order::LittleIntBigReal>($($argument),*);
        };
    }
    use in_each_order;

    /// The numbers and bools that the `Debug` of plain values prints, in the order of the image.
    fn leaves(values: &impl std::fmt::Debug) -> Vec<String> {
        format!("{values:?}")
            .split(|c: char| !c.is_ascii_alphanumeric() && !"_.-".contains(c))
            .filter(|word| {
                matches!(*word, "true" | "false" | "NaN" | "inf" | "-inf")
                    || word.trim_start_matches('-').starts_with(|c: char| c.is_ascii_digit())
            })
            .map(str::to_owned)
            .collect()
    }

    /// `value` as it shows among the [`leaves`].
    fn leaf(value: FieldValue) -> String {
        match value {
            FieldValue::Bool(value) => format!("{value:?}"),
            FieldValue::Unsigned(value) => format!("{value:?}"),
            FieldValue::Signed(value) => format!("{value:?}"),
            FieldValue::Real(value) => format!("{value:?}"),
        }
    }
}
