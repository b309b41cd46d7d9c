-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries to add 1 to a long text.
local rd = require "refdyn"
local a, n = (" "):rep(1e6) .. "1", 0
for i = 1, 1e7 do n = a + 1 end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
