"""Speed against error beside other tools, goals, growth, first calls, scenes and design."""
