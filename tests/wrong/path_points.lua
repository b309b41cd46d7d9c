-- expect: 3: rd.path: sample 2 is not finite or equal to the one before it; neighbours must differ
local rd = require "refdyn"
local path = rd.path { { 0, 0, 0 }, { 0, 0, 0 } }
