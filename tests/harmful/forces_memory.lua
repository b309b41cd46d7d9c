-- expect: 0: more than 256 MB of memory to read the model
-- Tries to use all memory in forces.
local rd = require "refdyn"

return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } },
  forces = function(s)
    local t = {}
    while true do t[#t + 1] = { t } end
  end }
