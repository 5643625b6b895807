"""What stays sound: pairs of elements, explicit steps, slack cables, rounded-off terms, long runs."""
