-- expect: 6: string.rep: more than the 100 million steps that reading a model may take
-- Tries to use memory in pieces of one size after another.
local rd = require "refdyn"
for size = 4, 21 do
  local t = {}
  for i = 1, 2e8 // 2 ^ size // 4 do t[i] = ("x"):rep(2 ^ size | 0) .. i end
end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
