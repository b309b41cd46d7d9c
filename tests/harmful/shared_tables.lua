-- expect: 4: more than 32 tables nested in each other
-- Tries a table that holds itself many times.
local rd = require "refdyn"
local t = {}
for i = 1, 100 do t[i] = t end
return rd.model { name = "harmful", links = t }
