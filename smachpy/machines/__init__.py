"""What users build machines from: states, containers, and their checks."""
