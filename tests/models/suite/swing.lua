-- A point mass on a massless bar, from the horizontal at rest. Its period is 4 K(sin(pi / 4)) sqrt(L / g), K the
-- complete elliptic integral: 2.367841947576237 s.
local rd = require "refdyn"

return rd.model {
  name = "suite_swing", gravity = { 0, -9.81, 0 },
  links = { { "bar", joint = "psi", mass = 1, center = { 1, 0, 0 } } },
  points = { E = { on = "bar", at = { 1, 0, 0 } } },
}
