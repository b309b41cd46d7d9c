-- expect: 4: constraints: number of rows is 3000; must be at most that of coordinates, 3
-- Tries rows without a name, each of which gets the first unused number of its kind.
local rd = require "refdyn"
return rd.model {
  name = "harmful",
  links = { { "a", joint = { "x", "y", "z" }, mass = 1 } },
  constraints = function(s)
    local rows = {}
    for i = 1, 3000 do rows[i] = rd.distance { "a", { on = "ground", at = { i, 0, 0 } }, 1 } end
    return rows
  end,
}
