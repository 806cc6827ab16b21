"""The derivation beside the printed paper (`capsule_sym._paper`), statement by statement."""
