-- expect: 7: more than 100 million steps to read the model; look for a loop without an end
-- Tries to run forces endlessly.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    while true do end
  end }
