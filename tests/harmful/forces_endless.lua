-- Tries to run forces without end.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    while true do end
  end }
