-- expect: 5: tonumber: more than the 100 million steps that reading a model may take
-- Tries the same in another base.
local rd = require "refdyn"
local s = (" "):rep(1e6) .. "z"
for i = 1, 1e6 do tonumber(s, 36) end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
