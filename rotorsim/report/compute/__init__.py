"""What figures show, computed: pure functions of records and arrays that know no plot library."""
