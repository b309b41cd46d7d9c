-- expect: 5: more than 100 million steps to read the model; look for a loop without an end
-- Tries to order texts of bytes 0, which Lua compares one byte at a time.
local rd = require "refdyn"
local a, b, n = ("\0"):rep(511), ("\0"):rep(510), 0
for i = 1, 1e8 do if a < b then n = n + 1 end end
return rd.model { name = "harmful", links = { { "a", joint = "x", mass = 1 } } }
